// The simulated world against closed forms, against its own energy, and for the signs that everything else relies on.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "common/plant/world.hpp"

namespace farhand {
namespace {

static_assert(noexcept(std::declval<MasterWorld&>().advance(0, 0)) && noexcept(std::declval<MasterWorld&>().true_f()));
static_assert(noexcept(std::declval<DirectSlaveWorld&>().advance(0, 0)));
static_assert(noexcept(std::declval<SeriesElasticWorld&>().advance(0, 0)));

constexpr double kPi = std::numbers::pi;

// A rotor far from its stops, without friction, with an ideal encoder.
MotorAxis::Params free_motor() {
  MotorAxis::Params p;
  p.viscous = 0;
  p.encoder_counts_per_rev = 0;
  p.stop_min = -7;
  p.stop_max = 7;
  return p;
}

WorldNumerics by_steps(double step) {
  WorldNumerics numerics;
  numerics.settings.max_step = step;
  return numerics;
}

DirectSlaveWorld direct(const MotorAxis::Params& motor, const Environment::Params& environment = {}, double start = 0,
                        double step = 50e-6) {
  return DirectSlaveWorld({.motor = motor, .load = environment, .start = start}, by_steps(step));
}

TEST(DirectSlave, FallsFreelyUnderConstantTorque) {
  for (const double tau : {0.01, -0.01}) {
    DirectSlaveWorld world = direct(free_motor());
    world.advance(tau, 1.0);
    EXPECT_NEAR(world.true_x(), tau / (2 * 0.004), 1e-12);
    EXPECT_NEAR(world.true_v(), tau / 0.004, 1e-12);
    EXPECT_EQ(world.true_f(), 0.0);
  }
}

TEST(DirectSlave, ViscousFrictionEndsInTheKnownSpeed) {
  MotorAxis::Params motor = free_motor();
  motor.viscous = 0.02;
  DirectSlaveWorld world = direct(motor);
  world.advance(0.01, 0.5);
  EXPECT_NEAR(world.true_v(), 0.5 * (1.0 - std::exp(-0.02 / 0.004 * 0.5)), 1e-12);
}

// Period of a pendulum of any amplitude by the arithmetic-geometric mean; hanging is pi from the upright.

TEST(DirectSlave, SwingsAsAPendulumOfLargeAmplitude) {
  MotorAxis::Params motor = free_motor();
  motor.gravity = 0.3;
  motor.gravity_angle = kPi;
  const double start = 2.0;
  double a = 1.0, g = std::cos(start / 2.0);
  for (int i = 0; i < 8; ++i) {
    const double mean = 0.5 * (a + g);
    g = std::sqrt(a * g);
    a = mean;
  }
  const double period = 2.0 * kPi * std::sqrt(motor.J / motor.gravity) / a;
  DirectSlaveWorld world = direct(motor, {}, start);
  world.advance(0.0, period / 4.0);
  EXPECT_NEAR(world.true_x(), 0.0, 1e-9);
  world.advance(0.0, period);
  EXPECT_NEAR(world.true_x(), start, 1e-9);
  EXPECT_NEAR(world.true_v(), 0.0, 1e-8);
}

TEST(DirectSlave, WeightPullsAwayFromTheUpright) {
  for (const double side : {1.0, -1.0}) {
    MotorAxis::Params motor = free_motor();
    motor.gravity = 0.3;
    motor.gravity_angle = side * 0.2;
    DirectSlaveWorld falls = direct(motor), held = direct(motor);
    falls.advance(0.0, 1e-3);
    EXPECT_GT(side * falls.true_v(), 0.0);
    held.advance(-motor.gravity * std::sin(motor.gravity_angle), 1e-3);
    EXPECT_NEAR(held.true_v(), 0.0, 1e-15);
  }
}

TEST(DirectSlave, AHandMakesADampedOscillator) {
  const Hand::Params hand{.stiffness = 5, .damping = 0.02, .rest = 0.05};
  DirectSlaveWorld world = direct(free_motor(), {.hand = hand}, 0.25);
  const double J = 0.004, decay = hand.damping / (2 * J), w = std::sqrt(hand.stiffness / J - decay * decay);
  for (int k = 0; k < 500; ++k) {
    world.advance(0.0, (k + 1) * 1e-3);
    const double t = (k + 1) * 1e-3;
    const double x = 0.05 + 0.2 * std::exp(-decay * t) * (std::cos(w * t) + decay / w * std::sin(w * t));
    ASSERT_NEAR(world.true_x(), x, 1e-9) << t;
  }
}

TEST(Hand, IsThereOnlyInItsTime) {
  const Environment box({.hand = Hand::Params{.stiffness = 2, .damping = 0.02, .rest = 0.1, .from = 1, .until = 2}});
  const auto reaction = [&](double t, double x, double v) { return box.reaction(box.mode_at(t, x, v), t, x, v); };
  EXPECT_EQ(reaction(0.999, 0.3, 1.0), 0.0);
  EXPECT_NEAR(reaction(1.0, 0.3, 1.0), 0.42, 1e-15);
  EXPECT_NEAR(reaction(1.5, -0.1, -1.0), -0.42, 1e-15);
  EXPECT_EQ(reaction(2.0, 0.3, 1.0), 0.0);
  EXPECT_EQ(box.next_break(0.0), 1.0);
  EXPECT_EQ(box.next_break(1.0), 2.0);
  EXPECT_EQ(box.next_break(2.0), std::numeric_limits<double>::infinity());
}

TEST(Hand, ASpasticOneResistsOnlyAFastStretch) {
  Hand::Params spastic{.stiffness = 2, .damping = 0.02, .rest = 0.1, .from = 1, .spastic = 0.3, .spastic_above = 0.2};
  const Environment box({.hand = spastic});
  spastic.spastic = 0;
  const Environment plain({.hand = spastic});
  const auto more = [&](double t, double x, double v) {
    return box.reaction(box.mode_at(t, x, v), t, x, v) - plain.reaction(plain.mode_at(t, x, v), t, x, v);
  };
  EXPECT_NEAR(more(2, 0.3, 1.2), 0.3, 1e-15);     // going up above the rest angle
  EXPECT_NEAR(more(2, -0.1, -1.2), -0.3, 1e-15);  // going down below it
  EXPECT_NEAR(more(2, 0.3, 0.2 + 1e-9), 0.0, 1e-9);
  EXPECT_EQ(more(2, 0.3, 0.19), 0.0);
  EXPECT_EQ(more(2, 0.3, -1.2), 0.0);  // on the way back
  EXPECT_EQ(more(2, -0.1, 1.2), 0.0);
  EXPECT_EQ(more(0.9, 0.3, 1.2), 0.0);  // not in yet
}

// Pushed by a constant torque from rest, the axis is caught where its speed passes the threshold: from there on it is
// a system of first order in v with another damper. Every method meets that instant.
TEST(Hand, ASpasticCatchIsMetByEveryMethod) {
  const Hand::Params hand{.stiffness = 0, .damping = 0, .rest = -1, .spastic = 0.3, .spastic_above = 0.2};
  const double J = 0.004, torque = 0.02, caught = J * 0.2 / torque, end = 0.2;
  const double v = 0.2 + torque / 0.3 * (1 - std::exp(-0.3 / J * (end - caught)));
  for (const Method method :
       {Method::kAuto, Method::kRk4, Method::kSdirk2, Method::kRosenbrock, Method::kAdaptive, Method::kClosedForm}) {
    DirectSlaveWorld world({.motor = free_motor(), .load = {.hand = hand}}, {.method = method});
    for (int k = 1; k <= 200; ++k) world.advance(torque, k * 1e-3);
    EXPECT_NEAR(world.true_v(), v, method == Method::kAuto || method == Method::kClosedForm ? 1e-14 : 1e-7)
        << name_of(method);
    EXPECT_EQ(world.counters().events, 1u) << name_of(method);
  }
}

// Held still, the device feels k times the patient's own motion; nothing is felt before the hand comes in.
TEST(Hand, ARestAngleThatMovesIsFeltByWhoHoldsTheHand) {
  const Environment box(
      {.hand = Hand::Params{.stiffness = 3, .from = 1, .rest_amplitude = 0.15, .rest_frequency = 0.25}});
  const auto reaction = [&](double t) { return box.reaction(box.mode_at(t, 0.3, 0), t, 0.3, 0); };
  EXPECT_EQ(reaction(0.9), 0.0);
  EXPECT_NEAR(reaction(1.0), 3 * (0.3 - 0.15), 1e-15);
  EXPECT_NEAR(reaction(2.0), 3 * 0.3, 1e-15);
  EXPECT_NEAR(reaction(3.0), 3 * (0.3 + 0.15), 1e-15);
}

// From when the hand came in, whatever happened before.
TEST(Hand, MuscleToneFallsExponentially) {
  DirectSlaveWorld world({.motor = free_motor(),
                          .load = {.hand = Hand::Params{.stiffness = 5, .from = 1, .relaxed = 2, .relax_time = 4}}});
  EXPECT_EQ(world.method(), Method::kRk4);
  EXPECT_STREQ(world.choice().not_affine, "the stiffness of the hand follows the time");
  const Environment box({.hand = Hand::Params{.stiffness = 5, .from = 1, .relaxed = 2, .relax_time = 4}});
  const auto felt = [&](double t) { return box.reaction(box.mode_at(t, 0.1, 0), t, 0.1, 0); };
  EXPECT_EQ(felt(0.5), 0.0);
  EXPECT_NEAR(felt(1), 0.5, 1e-15);
  EXPECT_NEAR(felt(5), 0.2 + 0.3 * std::exp(-1), 1e-15);
  EXPECT_NEAR(felt(1e3), 0.2, 1e-15);
}

// An oscillator under a sine of torque, once its own motion has died away: the same by every method.
TEST(Hand, TremblingShakesTheAxisAsATorqueDoes) {
  const Hand::Params hand{.stiffness = 2, .damping = 0.1, .tremor = 0.05, .tremor_frequency = 5};
  const double J = 0.004, w = 2 * kPi * 5, elastic = 2 - J * w * w, viscous = 0.1 * w;
  const double amplitude = 0.05 / std::hypot(elastic, viscous), lag = std::atan2(viscous, elastic);
  for (const Method method : {Method::kAuto, Method::kRk4, Method::kSdirk2, Method::kRosenbrock, Method::kAdaptive}) {
    DirectSlaveWorld world({.motor = free_motor(), .load = {.hand = hand}}, {.method = method});
    for (int k = 1; k <= 3000; ++k) world.advance(0, k * 1e-3);
    double worst = 0;
    for (int k = 3001; k <= 3400; ++k) {
      world.advance(0, k * 1e-3);
      worst = std::max(worst, std::fabs(world.true_x() - amplitude * std::sin(w * k * 1e-3 - lag)));
    }
    EXPECT_LT(worst, method == Method::kAuto ? 1e-12 : 1e-8) << name_of(method);
  }
}

// The axis rests at a deflection; the hand that comes in there gives it exactly its own spring energy.

TEST(Hand, PutInAtADeflectionItPushesAtOnce) {
  const Hand::Params hand{.stiffness = 2, .damping = 0, .rest = 0.2, .from = 0.5};
  DirectSlaveWorld world = direct(free_motor(), {.hand = hand});
  world.advance(0.0, 0.5);
  EXPECT_EQ(world.true_x(), 0.0);
  EXPECT_NEAR(world.true_f(), -0.4, 1e-15);
  const double w = std::sqrt(2 / 0.004);
  world.advance(0.0, 0.5 + kPi / w / 2);
  EXPECT_NEAR(world.true_v(), 0.2 * w, 1e-12);
}

TEST(Wall, NeverPullsAndResistsOnItsSideOnly) {
  std::mt19937_64 random(7);
  const auto uniform = [&](double a) { return a * (2.0 * static_cast<double>(random() >> 11) * 0x1p-53 - 1.0); };
  for (int i = 0; i < 20000; ++i) {
    const Wall::Params p{.stiffness = 1e4, .damping = std::fabs(uniform(2)), .at = uniform(0.3)};
    const Wall wall(p);
    const double x = uniform(0.5), v = uniform(5), side = p.at < 0 ? -1.0 : 1.0;
    const double f = wall.reaction(x, v);
    ASSERT_GE(side * f, 0.0);
    if (side * (x - p.at) <= 0) {
      ASSERT_EQ(f, 0.0);
    }
    if (side * (x - p.at) > 0 && side * v > 0) {
      ASSERT_NEAR(f, p.stiffness * (x - p.at) + p.damping * v, 1e-9);
    }
    ASSERT_GE(wall.dissipated_power(wall.pushes(x, v), x, v), -1e-9);
  }
}

TEST(Wall, BalancesASteadyPressInBothDirections) {
  for (const double side : {1.0, -1.0}) {
    DirectSlaveWorld world = direct({}, {.wall = Wall::Params{.at = side * 0.1}});
    world.advance(side * 0.5, 2.0);
    EXPECT_NEAR(world.true_f(), side * 0.5, 1e-9);
    EXPECT_NEAR(world.true_x(), side * (0.1 + 0.5 / 1000), 1e-9);
  }
}

// A coasting rotor hits the wall with speed v and leaves it when the torque would pull. In contact it is a damped

// oscillator, so with d = b / 2J and w^2 = k / J - d^2 it leaves at tan(w t) = -b w / (k - b d) with v exp(-d t) (cos(w

// t) - d / w sin(w t)). The instant of touching is located, wherever it lies in a step.

TEST(Wall, ThrowsBackAsItsClosedFormSays) {
  const double k = 1e4, b = 1.26, J = 0.004, d = b / (2 * J), w = std::sqrt(k / J - d * d);
  const double t = (kPi - std::atan(b * w / (k - b * d))) / w;
  const double kept = std::exp(-d * t) * (std::cos(w * t) - d / w * std::sin(w * t));  // negative
  for (const Method method : {Method::kAuto, Method::kRk4}) {
    double worst = 0;
    for (const double side : {1.0, -1.0}) {
      for (int i = 0; i < 20; ++i) {  // the instant of touching moves through the step
        DirectSlavePlant::Params p{.motor = free_motor()};
        p.load.wall = Wall::Params{.stiffness = k, .damping = b, .at = side * 0.1};
        WorldNumerics numerics;
        numerics.method = method;
        DirectSlaveWorld world(p, numerics);
        const double tau = side * (0.2 + 1e-3 * i), v = tau / J * 0.05;
        world.advance(tau, 0.05);
        world.advance(0.0, 0.08);
        worst = std::fmax(worst, std::fabs(world.true_v() / v - kept));
      }
    }
    std::printf("impact, %s: keeps %.4f of its speed, error at most %.1e\n", name_of(method).data(), -kept, worst);
    // RK4: (w h)^5 / 120 per step, over the 40 steps of a contact.
    EXPECT_LT(worst, method == Method::kRk4 ? 40 * std::pow(w * 50e-6, 5) / 120 : 1e-12);
  }
}

// Pressed on by a constant torque it bounces and comes to rest.

TEST(Wall, BouncesAtFiftyMicrosecondsAsExactly) {
  for (const double tau : {0.05, 0.2, 1.0}) {
    DirectSlavePlant::Params p;
    p.load.wall = Wall::Params{.stiffness = 1e4, .damping = 1.26, .at = 0.1};
    WorldNumerics rk4;
    rk4.method = Method::kRk4;
    DirectSlaveWorld stepped(p, rk4), exact(p);
    double peak_x = 0, peak_f = 0, worst_x = 0;
    for (int k = 0; k < 3000; ++k) {
      stepped.advance(tau, (k + 1) * 1e-3);
      exact.advance(tau, (k + 1) * 1e-3);
      peak_x = std::fmax(peak_x, exact.true_x());
      peak_f = std::fmax(peak_f, exact.true_f());
      worst_x = std::fmax(worst_x, std::fabs(stepped.true_x() - exact.true_x()));
    }
    std::printf("bounces under %.2f N m: deepest %.3f mrad, hardest %.2f N m, RK4 at 50 us against exact %.2e rad\n",
                tau, 1e3 * (peak_x - 0.1), peak_f, worst_x);
    EXPECT_LT(worst_x, 1e-6);
    EXPECT_NEAR(exact.true_f(), tau, 1e-6);
    EXPECT_NEAR(stepped.true_x(), exact.true_x(), 1e-9);
  }
}

TEST(Wall, OfAMillionIsStillResolvedByTheDefaultStep) {
  WorldNumerics rk4;
  rk4.method = Method::kRk4;
  DirectSlaveWorld world({.load = {.wall = Wall::Params{.stiffness = 1e6, .damping = 12.6, .at = 0.1}}}, rk4);
  double last = 0;
  for (int k = 0; k < 2000; ++k) {
    world.advance(0.5, (k + 1) * 1e-3);
    ASSERT_TRUE(std::isfinite(world.true_v()));
    ASSERT_LT(world.true_x(), 0.102);
    last = world.true_f();
  }
  EXPECT_NEAR(last, 0.5, 1e-6);
}

// One world under every method: what they leave is their own error, and no two share a step formula.

TEST(Stops, HoldThreeNewtonMetresWithinAMilliradianAndNoPersonFeelsThem) {
  for (const double side : {1.0, -1.0}) {
    DirectSlaveWorld world = direct({});
    double deepest = 0;
    for (int k = 0; k < 1000; ++k) {
      world.advance(side * 3.0, (k + 1) * 1e-3);
      deepest = std::fmax(deepest, side * world.true_x() - 0.349);
    }
    EXPECT_NEAR(side * world.true_x() - 0.349, 1e-3, 1e-6);
    // Hit at full torque over the whole range: v = sqrt(2 tau x / J) = 22.9 rad/s, v sqrt(J/k) = 26 mrad without
    // damping.
    EXPECT_LT(deepest, 0.0265);
    EXPECT_EQ(world.true_f(), 0.0);
  }
}

TEST(Encoder, ErrsByHalfACountAtMostAndHasNoBias) {
  for (const double counts : {20000.0, 80000.0, 100.0}) {
    const double count = 2 * kPi / counts;
    double sum = 0;
    for (int i = -20000; i <= 20000; ++i) {
      const double x = i * 1.7e-5 + 1e-7, q = quantised(x, counts);
      ASSERT_LE(std::fabs(q - x), 0.5 * count * (1 + 1e-9));
      ASSERT_NEAR(q / count, std::round(q / count), 1e-9);
      ASSERT_EQ(quantised(q, counts), q);
      sum += q - x;
    }
    EXPECT_LT(std::fabs(sum / 40001), 0.02 * count + 2e-7);
  }
  EXPECT_EQ(quantised(0.123456789, 0.0), 0.123456789);
}

// K_h against a device that is locked, by a wall far stiffer than any grip or simply by standing still: the person

// feels it whole.

TEST(Master, TrueForceIsMinusTheTherapistsPushInBothDirections) {
  for (const double side : {1.0, -1.0}) {
    MasterWorld::Params p;
    p.load.intended = {Movement::ramp(side * 0.3, 1)};
    MasterWorld world(p);
    for (int k = 0; k < 3000; ++k) {  // a stiff controller holds the device at 0
      const double tau = std::fmax(-3.0, std::fmin(3.0, -400 * world.true_x() - 1.0 * world.true_v()));
      world.advance(tau, (k + 1) * 1e-3);
    }
    const double x = world.true_x();
    EXPECT_NEAR(x, side * 3 * 0.3 / 403, 1e-6);
    EXPECT_NEAR(world.true_f(), -3 * (side * 0.3 - x), 1e-6);
    EXPECT_LT(side * world.true_f(), 0.0);
    EXPECT_NEAR(world.truth().intended_x, side * 0.3, 1e-15);
  }
}

// At a stop the therapist presses with K_h times what he intends. One reaction time after it has become too much he
// draws back at his speed, and stops where just as much is felt as he wants.
TEST(Master, ATherapistGivesWayAfterHisReactionTime) {
  for (const double side : {1.0, -1.0}) {
    MasterWorld::Params p{.motor = free_motor()};
    p.motor.stop_min = -1e-9, p.motor.stop_max = 1e-9;  // the device cannot move but by the stop's softness
    p.load = {.K_h = 10,
              .B_h = 0.15,
              .intended = {Movement::ramp(side * 0.3, 0.5), Movement::hold(3), Movement::ramp(0, 0.5)}};
    const MasterWorld::Params firm = p;
    p.load.reaction = VoluntaryReaction::Params{.above = 1, .after = 0.2, .speed = 0.3};
    MasterWorld world(p), other(firm);
    double too_much = 0, begun = 0, before = 0, fastest = 0;
    for (int k = 1; k <= 6000; ++k) {
      const double t = k * 1e-3;
      world.advance(0, t), other.advance(0, t);
      const double drawn_back = side * (other.truth().intended_x - world.truth().intended_x);
      EXPECT_GE(drawn_back, -1e-15);
      fastest = std::max(fastest, std::fabs(drawn_back - before) / 1e-3);
      before = drawn_back;
      if (too_much == 0 && 10 * (side * (other.truth().intended_x - world.true_x())) > 1) too_much = t;
      if (begun == 0 && drawn_back > 0) begun = t;
      if (k == 3400) {
        EXPECT_NEAR(side * world.true_f(), -1, 1e-6);
        EXPECT_NEAR(side * other.true_f(), -10 * 0.3 / (1 + 10 / 3000.0), 1e-6);
      }
    }
    EXPECT_NEAR(begun - too_much, 0.2, 1e-12);
    EXPECT_NEAR(fastest, 0.3, 1e-9);
    EXPECT_EQ(world.truth().intended_x, other.truth().intended_x);  // all is given back once nothing is felt
  }
}

// Decisions fall at his own times: it is one whether a world is asked for tick by tick, or for many ticks at once, or
// at times in between.
TEST(Master, ATherapistDecidesAtHisOwnTimes) {
  MasterWorld::Params p;
  p.load.K_h = 10;
  p.load.intended = {Movement::ramp(0.3, 0.5)};
  p.load.reaction = VoluntaryReaction::Params{.above = 0.3, .after = 0.1};
  for (const Method method : {Method::kClosedForm, Method::kRk4, Method::kAdaptive}) {
    MasterWorld tick_by_tick(p, {.method = method}), at_once(p, {.method = method}), between(p, {.method = method});
    double most = 0;
    for (int k = 1; k <= 100; ++k) {
      const double torque = -0.7 - 0.2 * std::sin(0.1 * k);
      for (int i = 1; i <= 20; ++i) {
        between.advance(torque, 0.02 * (k - 1) + 1e-3 * i - 0.37e-3);
        between.advance(torque, 0.02 * (k - 1) + 1e-3 * i);
        tick_by_tick.advance(torque, 0.02 * (k - 1) + 1e-3 * i);
      }
      at_once.advance(torque, 0.02 * k);
      const double tolerance = method == Method::kRk4 ? 1e-9 : 1e-12;
      EXPECT_NEAR(at_once.true_x(), tick_by_tick.true_x(), tolerance) << name_of(method);
      EXPECT_NEAR(between.true_x(), tick_by_tick.true_x(), tolerance) << name_of(method);
      EXPECT_NEAR(at_once.truth().intended_x, tick_by_tick.truth().intended_x, tolerance) << name_of(method);
      most = std::max(most, 0.3 - at_once.truth().intended_x);
    }
    EXPECT_GT(most, 0.02);
  }
}

TEST(Master, WhoNeverFeelsTooMuchMovesAsWhoDoesNotReact) {
  MasterWorld::Params p;
  p.load.intended = {Movement::ramp(0.3, 0.5)};
  MasterWorld plain(p);
  p.load.reaction = VoluntaryReaction::Params{.above = 5};
  MasterWorld calm(p);
  for (int k = 1; k <= 1000; ++k) {
    plain.advance(-0.3, k * 1e-3), calm.advance(-0.3, k * 1e-3);
    ASSERT_EQ(plain.true_x(), calm.true_x());
    ASSERT_EQ(plain.true_f(), calm.true_f());
  }
}

TEST(Master, WhoGivesWayNeedsAnArmToFeelBy) {
  MasterWorld::Params p;
  p.load.K_h = 0;
  p.load.reaction = VoluntaryReaction::Params{};
  EXPECT_THROW(MasterWorld{p}, std::invalid_argument);
}

// Third way: the equation of the device alone, J a = tau - resistance - f, with a from differences of the velocity.

TEST(Master, TrueForceIsWhatTheDevicesOwnEquationLeaves) {
  MasterWorld::Params p;
  p.load.intended = {Movement::sine(0.25, 2, 10)};
  p.motor = free_motor();
  p.motor.viscous = 0.002;
  p.motor.gravity = 0.2;
  p.motor.gravity_angle = 0.3;
  MasterWorld world(p);
  const double h = 1e-4;
  double v0 = 0, f1 = 0, v1 = 0, x1 = 0, tau1 = 0, largest = 0;
  for (int k = 0; k < 20000; ++k) {
    const double tau = 0.3 * std::sin(5e-4 * k);
    world.advance(tau, (k + 1) * h);
    if (k > 1) {
      const double a = (world.true_v() - v0) / (2 * h);
      const double weight = p.motor.gravity * std::sin(x1 + p.motor.gravity_angle);
      const double f = 0.5 * (tau1 + tau) - p.motor.viscous * v1 + weight - p.motor.J * a;
      // f1 was read under tau1, a sees half of the next torque as well.
      const double half_step = 0.5 * (tau - tau1) * p.load.J_h / (p.motor.J + p.load.J_h);
      ASSERT_NEAR(f, f1 + half_step, 2e-5);
      largest = std::fmax(largest, std::fabs(f));
    }
    v0 = v1, v1 = world.true_v(), x1 = world.true_x(), f1 = world.true_f(), tau1 = tau;
  }
  EXPECT_GT(largest, 0.3);
}

TEST(Master, AFreelyHeldDeviceGoesWhereTheTherapistWants) {
  for (const Grip grip : {kLightGrip, kNormalGrip, kFirmGrip}) {
    MasterWorld::Params p;
    p.load.K_h = grip.K_h;
    p.load.B_h = grip.B_h;
    p.load.intended = {Movement::ramp(0.3, 1)};
    MasterWorld world(p);
    world.advance(0.0, 10.0);
    EXPECT_NEAR(world.true_x(), 0.3, 1e-6) << grip.K_h;
    EXPECT_NEAR(world.true_f(), 0.0, 1e-5);
  }
}

// Tendon friction stands between spring and hand: at rest the two differ by at most its level, and by all of it after a

// long stroke.

// Third way, from outside only: a motor that does work on an undamped hand must find it there again.

TEST(Energy, WorkReadFromOutsideIsWhatTheHandHolds) {
  MotorAxis::Params motor = free_motor();
  DirectSlaveWorld world = direct(motor, {.hand = Hand::Params{.stiffness = 2, .damping = 0}});
  double work = 0;
  for (int k = 0; k < 4000; ++k) {
    const double before = world.true_x(), tau = 0.2 * std::sin(0.004 * k);
    world.advance(tau, (k + 1) * 1e-3);
    work += tau * (world.true_x() - before);  // exact: the torque is held
  }
  const double held = 0.5 * 2 * world.true_x() * world.true_x() + 0.5 * 0.004 * world.true_v() * world.true_v();
  EXPECT_NEAR(work, held, 1e-10);
  EXPECT_GT(std::fabs(work), 1e-4);
}

}  // namespace
}  // namespace farhand
