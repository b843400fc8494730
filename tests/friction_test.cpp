// Dry friction: the bristle against Dahl's and LuGre's closed forms, Coulomb against a block on a belt, and what sticks
// stands still.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>

#include "common/integrate/dormand_prince.hpp"
#include "common/integrate/integrator.hpp"
#include "common/integrate/rosenbrock.hpp"
#include "common/plant/world.hpp"

namespace farhand {
namespace {

constexpr double kPi = std::numbers::pi;

IntegratorSettings tight(double max_step = 1e-3) {
  IntegratorSettings settings;
  settings.max_step = max_step, settings.rtol = 1e-12, settings.atol = 1e-15;
  return settings;
}
WorldNumerics by(Method method) {
  WorldNumerics numerics;
  numerics.method = method;
  return numerics;
}
MotorAxis::Params bare() { return {.viscous = 0, .encoder_counts_per_rev = 0, .stop_min = -7, .stop_max = 7}; }

// A bristle that is led along a given motion.
struct Led {
  static constexpr std::size_t kStates = 3, kGuards = 1;  // torque of the bristle, work, loss
  using State = std::array<double, kStates>;
  Bristle bristle;
  double amplitude, w;
  double velocity(double t) const noexcept { return amplitude * w * std::cos(w * t); }
  Mode mode_at(double t, const State& /*s*/) const noexcept { return velocity(t) < 0 ? kSlidesBack : 0u; }
  State derivative(Mode mode, double t, const State& s) const noexcept {
    const double v = velocity(t), rate = bristle.rate(direction(mode), v, s[0]);
    return {bristle.params().sigma_0 * rate, bristle.torque(s[0], v, rate) * v,
            bristle.dissipated_power(v, s[0], rate)};
  }
  StateMatrix<kStates> jacobian(Mode, double, const State&) const noexcept { return {}; }
  State time_derivative(Mode, double, const State&) const noexcept { return {}; }
  std::array<double, kGuards> guards(Mode mode, double t, const State& /*s*/) const noexcept {
    return {direction(mode) * velocity(t)};
  }
  Mode cross(Mode mode, std::size_t, double, State&) const noexcept { return mode ^ kSlidesBack; }
  double next_break(double) const noexcept { return INFINITY; }
};

TEST(Bristle, TendsToItsLevelAndTurnsRoundWithTwiceItsSlope) {
  const Bristle dahl(Bristle::dahl(0.05, 20));
  const auto slope = [&](double F, double v) { return 20 * dahl.rate(v < 0 ? -1 : 1, v, F) / v; };
  for (const double side : {1.0, -1.0}) {
    EXPECT_NEAR(slope(0.0, side * 0.3), 20, 1e-12);
    EXPECT_NEAR(slope(-side * 0.05, side * 0.3), 40, 1e-12);
    EXPECT_NEAR(slope(side * 0.05, side * 0.3), 0.0, 1e-12);
  }
}

// Of Dahl's friction only the distance matters: from F = 0 the torque is F_c (1 - exp(-sigma x / F_c)), at any speed.
TEST(Bristle, WithOneLevelAndNoDampingIsDahls) {
  for (const double w : {0.5, 3.0, 20.0}) {
    const Led plant{Bristle({.F_c = 0.05, .F_s = 0.05, .v_s = 0.01, .sigma_0 = 20}), 0.02, w};
    Integrator<DormandPrince, Led> run(tight());
    run.start(plant, 0, {});
    run.advance(plant, kPi / 2 / w);
    EXPECT_NEAR(run.state()[0], 0.05 * (1 - std::exp(-20 * 0.02 / 0.05)), 1e-11);
  }
}

TEST(Bristle, OverACycleItsWorkIsItsLoss) {
  const double F_c = 0.05, A = 0.2, w = 3.0, T = 2 * kPi / w;
  const Led plant{Bristle(Bristle::dahl(F_c, 20)), A, w};
  Integrator<DormandPrince, Led> run(tight(1e-2));
  run.start(plant, 0, {});
  run.advance(plant, T);
  const Led::State before = run.state();
  run.advance(plant, 2 * T);
  const double work = run.state()[1] - before[1];
  EXPECT_NEAR(work, run.state()[2] - before[2], 1e-10);
  // Each stroke of 2 A from -F_c: integral of F_c (1 - 2 exp(-sigma x / F_c)) = F_c (2 A - 2 F_c / sigma).
  EXPECT_NEAR(work, 2 * F_c * (2 * A - 2 * F_c / 20), 1e-9);
}

// Sliding steadily its torque is g(v) + sigma_2 v: Stribeck's curve.
TEST(Bristle, SlidesAlongStribecksCurve) {
  const Bristle::Params p{.F_c = 0.05, .F_s = 0.08, .v_s = 0.1, .sigma_0 = 60, .sigma_1 = 0.01, .sigma_2 = 0.003};
  for (const double v : {0.02, 0.1, 0.3, -0.05, -0.5}) {
    const Bristle lugre(p);
    const double g = p.F_c + (p.F_s - p.F_c) * std::exp(-std::pow(v / p.v_s, 2)), d = v < 0 ? -1 : 1;
    EXPECT_NEAR(lugre.rate(d, v, d * g), 0, 1e-15);
    EXPECT_NEAR(lugre.torque(d * g, v, 0), d * g + p.sigma_2 * v, 1e-15);
  }
}

// Small motion in a bristle that does not slide: a spring of sigma_0 and a damper of sigma_1 + sigma_2.
TEST(Bristle, IsASpringAndDamperWhileItHolds) {
  const Bristle::Params p{.F_c = 10, .F_s = 12, .v_s = 1, .sigma_0 = 40, .sigma_1 = 0.01, .sigma_2 = 0.005};
  MotorAxis::Params motor = bare();
  motor.bristle = p;
  for (const Method method : {Method::kRk4, Method::kRosenbrock, Method::kAdaptive}) {
    DirectSlaveWorld world({.motor = motor}, by(method));
    const double J = motor.J, decay = 0.015 / (2 * J), w = std::sqrt(40 / J - decay * decay), tau = 1e-5;
    double worst = 0;
    for (int k = 0; k < 300; ++k) {
      world.advance(tau, (k + 1) * 1e-3);
      const double t = (k + 1) * 1e-3;
      const double x = tau / 40 * (1 - std::exp(-decay * t) * (std::cos(w * t) + decay / w * std::sin(w * t)));
      worst = std::fmax(worst, std::fabs(world.true_x() - x));
    }
    EXPECT_LT(worst, 10 * (2 * tau / 12) * tau / 40) << name_of(method);  // ten swings, each bent by F / g
  }
}

// A block on a belt, seen from the belt: the arm's far end moves at V and drags the block by K. It breaks away once the
// spring pulls F_c and then swings about that: x = V s - V / w sin(w s) at s after.
TEST(Coulomb, ABlockOnABeltBreaksAwayAsItsClosedForm) {
  const double K = 3, F_c = 0.06, J = 0.005, V = 0.05, w = std::sqrt(K / J), f = 1e-4;
  for (const double side : {1.0, -1.0}) {
    for (const Method method : {Method::kAuto, Method::kRk4, Method::kSdirk2, Method::kAdaptive}) {
      MasterPlant::Params p{.motor = bare()};
      p.motor.coulomb = F_c;
      p.load.K_h = K, p.load.B_h = 0;
      p.load.intended = {Movement::sine(side * V / (2 * kPi * f), f, 10)};  // bent by V (2 pi f)^2 t^3 / 6, 1e-9 rad
      MasterWorld world(p, by(method));
      const double breaks = F_c / (K * V), s = 0.6 * 2 * kPi / w;
      world.advance(0, breaks - 1e-4);
      EXPECT_EQ(world.true_x(), 0.0);
      EXPECT_EQ(world.true_v(), 0.0);
      world.advance(0, breaks + s);
      EXPECT_NEAR(side * world.true_x(), V * s - V / w * std::sin(w * s), method == Method::kSdirk2 ? 1e-8 : 2e-9)
          << name_of(method);
    }
  }
}

// Let go at a deflection, each half swing loses 2 F_c / K, and at the first turning point within F_c / K it stays.
TEST(Coulomb, ASwingDiesInEqualSteps) {
  const Hand::Params hand{.stiffness = 5, .damping = 0};
  for (const Method method : {Method::kAuto, Method::kRk4, Method::kSdirk2, Method::kRosenbrock, Method::kAdaptive}) {
    for (const double side : {1.0, -1.0}) {
      DirectSlavePlant::Params p{.motor = bare(), .load = {.hand = hand}, .start = side * 0.25};
      p.motor.coulomb = 0.1;
      DirectSlaveWorld world(p, by(method));
      const double half = kPi / std::sqrt(5 / 0.004);
      double amplitude = 0.25, worst = 0;
      for (int k = 1; k <= 8; ++k) {
        world.advance(0, k * half);
        if (amplitude > 0.02) amplitude -= 0.04;  // .25 .21 .17 .13 .09 .05 .01
        const double sign = std::min(k, 6) % 2 == 0 ? 1 : -1;
        worst = std::fmax(worst, std::fabs(side * world.true_x() - sign * amplitude));
        if (k > 6) {
          EXPECT_EQ(world.true_v(), 0.0) << name_of(method);
        }
      }
      std::printf("swing with Coulomb friction, %s: %.1e rad\n", name_of(method).data(), worst);
      EXPECT_LT(worst, method == Method::kSdirk2 ? 1e-5 : 2e-8) << name_of(method);
    }
  }
}

TEST(Coulomb, StopsAFreeAxisWhereTheClosedFormSays) {
  MotorAxis::Params motor = bare();
  motor.coulomb = 0.1;
  for (const Method method : {Method::kAuto, Method::kRk4, Method::kSdirk2, Method::kRosenbrock}) {
    for (const double side : {1.0, -1.0}) {
      DirectSlaveWorld world({.motor = motor}, by(method));
      for (int k = 0; k < 1000; ++k) {  // (0.3 - 0.1) N m for 0.1 s, then friction alone for 0.2 s, then rest
        world.advance(k < 100 ? side * 0.3 : 0.0, (k + 1) * 1e-3);
        if (k >= 300) {
          ASSERT_EQ(world.true_v(), 0.0) << name_of(method);
        }
      }
      const double v = 0.2 / 0.004 * 0.1;
      EXPECT_NEAR(side * world.true_x(), 0.5 * v * 0.1 + 0.5 * v * 0.2, 1e-9) << name_of(method);
    }
  }
}

TEST(Coulomb, UpToItsTorqueNothingMovesAndBeyondItAtOnce) {
  MotorAxis::Params motor = bare();
  motor.coulomb = 0.1;
  DirectSlaveWorld world({.motor = motor});
  for (int k = 0; k < 2000; ++k) {
    world.advance(0.0999 * std::sin(0.01 * k), (k + 1) * 1e-3);
    ASSERT_EQ(world.true_x(), 0.0);
    ASSERT_EQ(world.true_v(), 0.0);
  }
  world.advance(0.101, 2.001);
  EXPECT_NEAR(world.true_v(), 0.001 / 0.004 * 1e-3, 1e-15);
  EXPECT_EQ(world.counters().events, 1u);
}

// Pressed into a wall and then held by less, it stays where it is as long as friction can make up the difference.
TEST(Coulomb, HoldsAnAxisPressedIntoAWall) {
  MotorAxis::Params motor = bare();
  motor.coulomb = 0.1;
  DirectSlaveWorld world({.motor = motor, .load = {.wall = Wall::Params{.at = 0.01}}});
  auto press = [&, t = 0.0](double torque) mutable {
    for (int k = 0; k < 500; ++k, t += 1e-3) world.advance(torque, t + 1e-3);
    return world.true_f();
  };
  const double pressed = press(1.0);
  EXPECT_NEAR(pressed, 1.0, 0.1);
  EXPECT_EQ(press(pressed - 0.099), pressed);
  EXPECT_EQ(world.power().dissipated, 0.0);
  EXPECT_LT(press(pressed - 0.101), pressed);
  EXPECT_EQ(world.true_v(), 0.0);
}

TEST(Spring, ThatEndsCarriesMoreThanItsStretchTells) {
  SeriesElasticParams p{.environment = {.wall = Wall::Params{.stiffness = 1e4, .damping = 12, .at = 0.05}}};
  p.actuator.spring_range = 0.1;
  p.actuator.stop_max = 1;
  for (const Method method : {Method::kAuto, Method::kRk4}) {
    SeriesElasticWorld world(p, by(method));
    for (int k = 0; k < 3000; ++k) world.advance(k < 170 ? 1.0 : 0.0, (k + 1) * 1e-3);
    // 0.17 rad of the motor: 0.05 to the wall, 0.1 to the end of the spring, the rest against spring, end and wall.
    const double spring = world.truth().spring_torque, stretch = world.truth().motor_x - world.true_x();
    EXPECT_NEAR(world.truth().motor_x, 0.17, 1e-9);
    EXPECT_NEAR(spring, 10 * stretch + 3000 * (stretch - 0.1), 1e-9);
    EXPECT_NEAR(spring, world.true_f(), 1e-9);
    EXPECT_GT(spring, 40);
  }
}

}  // namespace
}  // namespace farhand
