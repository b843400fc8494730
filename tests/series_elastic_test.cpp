// The hand orthosis on its hand: motor, spring, joint, tendons.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/plant/world.hpp"

namespace farhand {
namespace {

constexpr double kPi = std::numbers::pi;

SeriesElasticWorld::Params orthosis(double tendon = 0) {
  SeriesElasticWorld::Params p;
  if (tendon > 0) p.actuator.tendon = Bristle::dahl(tendon, 20);
  p.actuator.joint_counts_per_rev = p.actuator.motor_counts_per_rev = 0;
  return p;
}

TEST(SeriesElastic, TheMotorFollowsItsFirstOrderLoopUpToItsSpeedLimit) {
  const double g = 2 * kPi * 30;
  for (const double u : {0.5, -0.5, 4.0, 9.0, -9.0}) {
    SeriesElasticWorld world(orthosis());
    const double reached = std::fmax(-4.0, std::fmin(4.0, u));
    for (int k = 0; k < 100; ++k) {
      world.advance(u, (k + 1) * 5e-4);
      const double t = (k + 1) * 5e-4;
      ASSERT_NEAR(world.truth().motor_v, reached * (1 - std::exp(-g * t)), 1e-9);
      ASSERT_NEAR(world.truth().motor_x, reached * (t - (1 - std::exp(-g * t)) / g), 1e-9);
      ASSERT_LE(std::fabs(world.truth().motor_v), 4.0);
    }
  }
}

TEST(SeriesElastic, TheSpringCarriesWhatTheHandHolds) {
  for (const double side : {1.0, -1.0}) {
    SeriesElasticWorld::Params p = orthosis();
    p.environment.hand = Hand::Params{.stiffness = 2};
    SeriesElasticWorld world(p);
    world.advance(side * 0.3, 1.0);
    world.advance(0.0, 6.0);
    const double x_motor = world.truth().motor_x;
    EXPECT_NEAR(x_motor, side * 0.3, 1e-9);
    EXPECT_NEAR(world.true_x(), x_motor * 10 / 12, 1e-6);
    EXPECT_NEAR(world.true_f(), world.truth().spring_torque, 1e-5);
    EXPECT_GT(side * world.true_f(), 0.0);
  }
}

TEST(SeriesElastic, TendonFrictionIsTheDifferenceBetweenSpringAndHand) {
  SeriesElasticWorld::Params p = orthosis(0.05);
  p.environment.hand = Hand::Params{.stiffness = 2};
  p.actuator.viscous = 0;
  SeriesElasticWorld world(p);
  double t = 0;
  for (const double direction : {1.0, -1.0, 1.0}) {
    for (int k = 0; k < 300; ++k, t += 1e-3) world.advance(direction * 0.5, t + 1e-3);
    const double v = world.true_v();
    const double carried = world.true_f() + world.truth().tendon_torque;
    EXPECT_NEAR(world.truth().spring_torque, carried, 0.03);  // the rest is J a
    EXPECT_NEAR(world.truth().tendon_torque, direction * 0.05, 1e-4) << v;
  }
}

TEST(SeriesElastic, WithoutTendonFrictionItsStateStaysZero) {
  SeriesElasticWorld world(orthosis());
  for (int k = 0; k < 500; ++k) {
    world.advance(2 * std::sin(0.05 * k), (k + 1) * 1e-3);
    ASSERT_EQ(world.truth().tendon_torque, 0.0);
  }
}

TEST(SeriesElastic, StopsHoldTheJointAndTheEncodersReadBothSides) {
  SeriesElasticWorld world({});
  world.advance(1.0, 0.8);
  world.advance(0.0, 3.0);
  EXPECT_NEAR(world.truth().motor_x, 0.8, 1e-6);
  EXPECT_NEAR(world.true_x() - 0.5236, 10 * (0.8 - 0.5236) / 3010, 1e-6);
  EXPECT_EQ(world.true_f(), 0.0);
  EXPECT_NEAR(world.encoder(), world.true_x(), kPi / 20000);
  EXPECT_NEAR(world.motor_encoder(), world.truth().motor_x, kPi / 20000);
}

}  // namespace
}  // namespace farhand
