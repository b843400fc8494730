// A world as a whole: which methods it takes and refuses, and that they agree.
#include "common/plant/world.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <string>

namespace farhand {
namespace {

WorldNumerics by_steps(double step) {
  WorldNumerics numerics;
  numerics.settings.max_step = step;
  return numerics;
}

SeriesElasticWorld::Params orthosis(double tendon = 0) {
  SeriesElasticWorld::Params p;
  if (tendon > 0) p.actuator.tendon = Bristle::dahl(tendon, 20);
  p.actuator.joint_counts_per_rev = p.actuator.motor_counts_per_rev = 0;
  return p;
}

TEST(World, RefusesAStepThatItsStiffestContactCannotSurvive) {
  const Environment::Params hard{.wall = Wall::Params{.stiffness = 1e9, .damping = 0.4, .at = 0.1}};
  const auto with = [](Method method, double step) {
    WorldNumerics numerics = by_steps(step);
    numerics.method = method;
    return numerics;
  };
  EXPECT_THROW(DirectSlaveWorld({.load = hard}, with(Method::kRk4, 50e-6)), std::invalid_argument);
  EXPECT_THROW(DirectSlaveWorld({.load = hard}, with(Method::kSemiImplicitEuler, 50e-6)), std::invalid_argument);
  EXPECT_THROW(MasterWorld({}, with(Method::kRk4, 0.01)), std::invalid_argument);
  SeriesElasticWorld::Params grains;
  grains.actuator.tendon = Bristle::dahl(1e-5, 20);
  EXPECT_THROW(SeriesElasticWorld(grains, with(Method::kRk4, 50e-6)), std::invalid_argument);
  for (const Method any : {Method::kAuto, Method::kRk4, Method::kAdaptive}) {
    EXPECT_THROW(MasterWorld({}, with(any, 0.0)), std::invalid_argument);
    EXPECT_THROW(MasterWorld({}, with(any, std::nan(""))), std::invalid_argument);
  }
  try {
    DirectSlaveWorld({.load = hard}, with(Method::kRk4, 50e-6));
  } catch (const std::invalid_argument& refusal) {
    // 2.6 / sqrt((1e9 + 3000) / 4e-3) s
    EXPECT_STREQ(
        refusal.what(),
        "world.step_s = 5e-05 s is too long for RK4 in this world: its fastest motion or stiffest contact needs "
        "more than 0 and at most 5.19999e-06 s; give a shorter step, an implicit method or AUTO");
  }
}

TEST(World, RefusesTheClosedFormWithTheReason) {
  WorldNumerics exact;
  exact.method = Method::kClosedForm;
  EXPECT_NO_THROW(MasterWorld({}, exact));
  const auto refusal = [](auto make) -> std::string {
    try {
      make();
    } catch (const std::invalid_argument& reason) {
      return reason.what();
    }
    return "not refused";
  };
  EXPECT_EQ(refusal([&] { MasterWorld({.motor = {.gravity = 0.2}}, exact); }),
            "world.method = CLOSED_FORM cannot advance this world: weight acts by the sine of the angle; give another "
            "method or AUTO");
  SeriesElasticWorld::Params rough;
  rough.actuator.tendon = Bristle::dahl(0.05, 20);
  EXPECT_EQ(
      refusal([&] { SeriesElasticWorld(rough, exact); }),
      "world.method = CLOSED_FORM cannot advance this world: the bristle's torque is multiplied by the speed; give "
      "another method or AUTO");
}

TEST(World, AutoIsExactWhereItCanBeAndElseFollowsTheStiffness) {
  EXPECT_EQ(MasterWorld({}).method(), Method::kClosedForm);
  EXPECT_EQ(MasterWorld({.motor = {.coulomb = 0.1}}).method(), Method::kClosedForm);
  EXPECT_EQ(MasterWorld({.motor = {.gravity = 0.2}}).method(), Method::kRk4);
  SeriesElasticWorld::Params p;
  EXPECT_EQ(SeriesElasticWorld(p).method(), Method::kClosedForm);
  p.actuator.tendon = Bristle::dahl(0.05, 20);
  EXPECT_EQ(SeriesElasticWorld(p).method(), Method::kRk4);
  p.actuator.tendon = Bristle::dahl(0.05, 1e7);
  EXPECT_EQ(SeriesElasticWorld(p).method(), Method::kSdirk2);
}

TEST(World, AllMethodsAgree) {
  const Environment::Params both{.hand = Hand::Params{.from = 0.2},
                                 .wall = Wall::Params{.stiffness = 1e4, .damping = 1.26, .at = 0.1}};
  const auto run = [&](Method method, double step) {
    WorldNumerics numerics = by_steps(step);
    numerics.method = method;
    DirectSlaveWorld world({.load = both}, numerics);
    for (int k = 0; k < 500; ++k) world.advance(0.3 * std::cos(9e-3 * k), (k + 1) * 1e-3);
    EXPECT_EQ(world.status(), IntegratorStatus::kOk);
    return world.true_x();
  };
  const double exact = run(Method::kClosedForm, 1e-3);
  EXPECT_NEAR(run(Method::kAdaptive, 1e-3), exact, 1e-8);
  EXPECT_NEAR(run(Method::kRk4, 20e-6), exact, 2e-9);
  EXPECT_NEAR(run(Method::kRosenbrock, 10e-6), exact, 1e-6);
  EXPECT_NEAR(run(Method::kSdirk2, 10e-6), exact, 1e-5);
  EXPECT_NEAR(run(Method::kSemiImplicitEuler, 5e-6), exact, 1e-3);
}

TEST(World, AdvancesAlikeInWhateverPiecesTimeIsCut) {
  SeriesElasticWorld::Params p = orthosis(0.05);
  p.environment.hand = Hand::Params{};
  MasterWorld::Params q;
  q.load.intended = {Movement::ramp(0.2, 0.5), Movement::ramp(0, 0.5)};
  SeriesElasticWorld whole(p), cut(p);
  MasterWorld whole_m(q), cut_m(q);
  std::mt19937_64 random(11);
  for (int k = 0; k < 1000; ++k) {
    const double t0 = k * 1e-3, t1 = (k + 1) * 1e-3, u = std::sin(0.01 * k);
    whole.advance(u, t1);
    whole_m.advance(0.1 * u, t1);
    for (double t = t0; t < t1;) {
      const double next = std::fmin(t1, t + 4e-4 * static_cast<double>(random() >> 11) * 0x1p-53);
      cut.advance(u, next);
      cut_m.advance(0.1 * u, next);
      t = next;
    }
    ASSERT_NEAR(whole.true_x(), cut.true_x(), 1e-7);
    ASSERT_NEAR(whole_m.true_x(), cut_m.true_x(), 1e-11);
  }
}

TEST(World, TwoRunsAreEqualToTheLastBit) {
  const auto run = [] {
    SeriesElasticWorld::Params p = orthosis(0.05);
    p.environment.wall = Wall::Params{};
    SeriesElasticWorld world(p);
    for (int k = 0; k < 1000; ++k) world.advance(std::sin(0.01 * k), (k + 1) * 1e-3);
    return std::array{world.true_x(), world.true_v(), world.truth().motor_x, world.truth().tendon_torque};
  };
  EXPECT_EQ(run(), run());
}

}  // namespace
}  // namespace farhand
