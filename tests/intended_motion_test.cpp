// Where the therapist wants the hand to be: closed forms, derivatives, and the same as a forcing of the arm.
#include "common/plant/intended_motion.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace farhand {
namespace {

constexpr double kPi = std::numbers::pi;

TEST(IntendedMotion, FollowsItsClosedForms) {
  const IntendedMotion motion({Movement::hold(1), Movement::ramp(0.3, 2), Movement::sine(0.1, 0.5, 4),
                               Movement::ramp(-0.2, 1), Movement::sine(0.1, 0.25, 1)});
  EXPECT_EQ(motion.at(-1).x, 0.0);
  EXPECT_EQ(motion.at(0.7).x, 0.0);
  EXPECT_NEAR(motion.at(2.0).x, 0.15, 1e-15);
  EXPECT_NEAR(motion.at(2.0).v, 1.875 * 0.3 / 2, 1e-15);  // peak of a minimum-jerk ramp
  EXPECT_NEAR(motion.at(2.0).a, 0.0, 1e-12);
  EXPECT_NEAR(motion.at(3.5).x, 0.4, 1e-15);
  EXPECT_NEAR(motion.at(3.5).v, 0.0, 1e-15);
  EXPECT_NEAR(motion.at(3.5).a, -0.1 * kPi * kPi, 1e-14);
  EXPECT_NEAR(motion.at(7.5).x, 0.05, 1e-14);
  EXPECT_DOUBLE_EQ(motion.end(), 9.0);
  for (const double t : {9.0, 9.5, 1e9}) {  // a quarter of a period: held where it ended
    EXPECT_NEAR(motion.at(t).x, -0.1, 1e-14);
    EXPECT_EQ(motion.at(t).v, 0.0);
    EXPECT_EQ(motion.at(t).a, 0.0);
  }
  EXPECT_EQ(IntendedMotion({}, 0.2).at(5).x, 0.2);
}

TEST(IntendedMotion, VelocityAndAccelerationAreTheDerivativesOfPosition) {
  const IntendedMotion motion({Movement::ramp(0.3, 1), Movement::ramp(-0.1, 0.7), Movement::sine(0.25, 0.5, 6)}, 0.05);
  const double h = 1e-4;
  for (double t = 0.01; t < 7.6; t += 0.00731) {
    if (std::fabs(t - 1) < 2 * h || std::fabs(t - 1.7) < 2 * h) continue;
    // Central differences: h^2/6 times the third and fourth derivative, at most 60 d/T^3 = 70 and 360 d/T^4 = 600.
    EXPECT_NEAR((motion.at(t + h).x - motion.at(t - h).x) / (2 * h), motion.at(t).v, 70 * h * h / 6 + 1e-11);
    EXPECT_NEAR((motion.at(t + h).v - motion.at(t - h).v) / (2 * h), motion.at(t).a, 600 * h * h / 6 + 1e-11);
  }
}

TEST(IntendedMotion, IsContinuousInPositionAndBetweenRampsInVelocityAndAcceleration) {
  const IntendedMotion motion({Movement::ramp(0.3, 1), Movement::hold(1), Movement::ramp(-0.2, 2), Movement::ramp(0, 1),
                               Movement::sine(0.2, 1, 1.3)});
  const double e = 1e-9;
  for (const double edge : {0.0, 1.0, 2.0, 4.0, 5.0, 6.3}) {
    EXPECT_NEAR(motion.at(edge - e).x, motion.at(edge + e).x, 3e-9) << edge;
    if (edge < 4.5) {
      EXPECT_NEAR(motion.at(edge - e).v, 0.0, 1e-12) << edge;
      EXPECT_NEAR(motion.at(edge + e).v, 0.0, 1e-12) << edge;
      EXPECT_NEAR(motion.at(edge - e).a, 0.0, 1e-7) << edge;
      EXPECT_NEAR(motion.at(edge + e).a, 0.0, 1e-7) << edge;
    }
  }
  EXPECT_NEAR(motion.at(5.0 + e).v, 0.2 * 2 * kPi, 1e-6);  // the sine takes up its velocity at once
}

TEST(IntendedMotion, AsAForcingItSaysTheSame) {
  const IntendedMotion motion(
      {Movement::hold(1), Movement::ramp(0.3, 2), Movement::sine(0.1, 0.5, 4.25), Movement::ramp(-0.2, 1)}, 0.02);
  for (double t = -1; t < 10; t += 0.0137) {
    const IntendedMotion::Point p = motion.at(t);
    const Forcing<long double> r = motion.forcing<long double>(t, 3, 0.06);
    ASSERT_NEAR(3 * p.x + 0.06 * p.v, static_cast<double>(r.at(t)), 1e-14) << t;
  }
}

}  // namespace
}  // namespace farhand
