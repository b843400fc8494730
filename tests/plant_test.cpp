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
#include "tests/support/free_motor.hpp"

namespace farhand {
namespace {

static_assert(noexcept(std::declval<MasterWorld&>().advance(0, 0)) && noexcept(std::declval<MasterWorld&>().true_f()));
static_assert(noexcept(std::declval<DirectSlaveWorld&>().advance(0, 0)));
static_assert(noexcept(std::declval<SeriesElasticWorld&>().advance(0, 0)));

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
