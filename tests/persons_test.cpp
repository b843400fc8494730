// The people of the simulated world: the patient's hand in all its moods, and a therapist who gives way.
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
#include "tests/support/free_motor.hpp"

namespace farhand {
namespace {

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

}  // namespace
}  // namespace farhand
