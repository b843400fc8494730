// The gate through which everything passes that an authentic peer says.
#include "common/station/intake.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/uniform.hpp"

namespace farhand {
namespace {

constexpr double kDt = 1e-3;
constexpr IntakeParams kLimits{};
constexpr double kBeyond = 0.0873;

Motion<1> told(double x, double v, double f) {
  Motion<1> motion;
  motion.x[0] = x;
  motion.v[0] = v;
  motion.f[0] = f;
  return motion;
}

TEST(Intake, WhatAPeerIsRightAboutPassesToTheBit) {
  std::mt19937_64 bits(1);
  Intake<1> intake(kLimits, kDt);
  double x = 0, v = 0;
  for (int k = 0; k < 100'000; ++k) {
    v = std::clamp(v + uniform(bits, -0.2, 0.2), -3.9, 3.9);
    if (std::abs(x + kDt * v) > 0.36) v = -v;
    x += kDt * v;
    const Motion<1> motion = told(x, v, uniform(bits, -3, 3));
    const Motion<1>& taken = intake.step(motion, false, true, 1);
    ASSERT_EQ(taken.x[0], motion.x[0]);
    ASSERT_EQ(taken.v[0], motion.v[0]);
    ASSERT_EQ(taken.f[0], motion.f[0]);
  }
  EXPECT_EQ(intake.cuts(), 0u);
}

TEST(Intake, FrictionOfThePeerIsKeptWithinTheOwnTorqueOrUnknown) {
  const Intake<1> intake({.torque = 2.0}, kDt);
  EXPECT_EQ(intake.friction(0.0), 0.0);
  EXPECT_EQ(intake.friction(0.05), 0.05);
  EXPECT_EQ(intake.friction(2.5), 2.0);
  EXPECT_EQ(intake.friction(std::numeric_limits<double>::infinity()), 2.0);
  EXPECT_TRUE(std::isnan(intake.friction(-1e-9)));
  EXPECT_TRUE(std::isnan(intake.friction(-1e300)));
  EXPECT_TRUE(std::isnan(intake.friction(std::numeric_limits<double>::quiet_NaN())));
}

TEST(Intake, WhateverIsToldStaysWithinTheLimitsOfThisSide) {
  std::mt19937_64 bits(2);
  const double wild[] = {0, 0.3, -0.3, 1, 3.2, 20, -20, 1e6, -1e6, 1e300, -1e300, std::numeric_limits<double>::max()};
  const auto any = [&] { return wild[static_cast<std::size_t>(uniform(bits, 0, 12))] * uniform(bits, -1, 1); };
  Intake<1> intake(kLimits, kDt);
  double last = 0;
  int since = 0;
  for (int k = 0; k < 100'000; ++k) {
    const bool held = uniform(bits, 0, 1)<0.2, driven = k> 0;
    const int ticks = uniform(bits, 0, 1) < 0.05 ? 7 : 1;
    since += ticks;
    const Motion<1>& taken = intake.step(told(any(), any(), any()), held, driven, ticks);
    intake.energy(any(), driven, ticks);
    ASSERT_LE(intake.cuts(), static_cast<std::uint64_t>(k) + 1) << "a tick counts once";
    ASSERT_LE(std::abs(taken.x[0]), kLimits.range_max + kBeyond);
    ASSERT_LE(std::abs(taken.v[0]), kLimits.velocity);
    ASSERT_LE(std::abs(taken.f[0]), kLimits.torque);
    if (driven) {
      ASSERT_LE(std::abs(taken.x[0] - last), kLimits.velocity * kDt * since + 1e-12);
    }
    last = taken.x[0];
    if (!held) since = 0;
  }
  EXPECT_GT(intake.cuts(), 90'000u);
}

TEST(Intake, AGapOfTheNetworkCostsNothing) {
  Intake<1> intake(kLimits, kDt);
  intake.step(told(-0.2, 0, 0), false, true, 1);
  for (int k = 0; k < 99; ++k) intake.step(told(-0.2, 0, 0), true, true, 1);
  EXPECT_EQ(intake.step(told(0.15, 3.5, 0), false, true, 1).x[0], 0.15);
  EXPECT_EQ(intake.cuts(), 0u);
}

// Neither buys time: every packet a little too late to be anything but the newest, or one far leap and then silence.
TEST(Intake, WhoIsAlwaysLateOrFallsSilentMovesNoFaster) {
  for (const bool late : {true, false}) {
    Intake<1> intake(kLimits, kDt);
    double last = intake.step(told(-0.3, 0, 0), false, true, 1).x[0];
    for (int k = 1; k <= 200; ++k) {
      const double x = intake.step(told(late ? -0.3 + 0.01 * k : 0.3, 0, 0), true, true, 1).x[0];
      ASSERT_LE(x - last, kLimits.velocity * kDt + 1e-12) << late << ' ' << k;
      last = x;
    }
    EXPECT_GT(last, 0.29) << "and gets there";
  }
}

TEST(Intake, AWaveGoesOnFromWhereItWasOnceItsSenderIsRightAgain) {
  IntakeParams limits;
  limits.wave = 6.0;
  Intake<1> intake(limits, kDt);
  double honest = 0.4;
  for (int k = 0; k < 1000; ++k) {
    honest += 1e-3 * std::sin(0.01 * k);
    ASSERT_EQ(intake.step(told(0, 0, honest), false, true, 1).f[0], honest);
  }
  const double before = intake.step(told(0, 0, honest), false, true, 1).f[0];
  // A minute of nonsense moves it by its slope and no further, and none of it is owed afterwards.
  double last = before;
  for (const double mad : {1e6, 1e300, -1e300, 1e-300, 40.0}) {
    for (int k = 0; k < 1000; ++k) {
      const double now = intake.step(told(0, 0, mad), false, true, 1).f[0];
      ASSERT_LE(std::abs(now - last), limits.wave * kDt * (1 + 1e-9));
      last = now;
    }
  }
  EXPECT_LE(std::abs(last - before), 5 * limits.wave * kDt + 1e-9);
  intake.step(told(0, 0, honest), false, true, 1);
  last = intake.step(told(0, 0, honest), false, true, 1).f[0];
  EXPECT_EQ(last, intake.step(told(0, 0, honest), false, true, 1).f[0]);
  EXPECT_NEAR(intake.step(told(0, 0, honest + 2e-3), false, true, 1).f[0], last + 2e-3, 1e-15);
}

TEST(Intake, AnEnergyGrowsByNoMoreThanTheAxisCouldHaveTakenIn) {
  Intake<1> intake(kLimits, kDt);
  double honest = 0.02;
  for (int k = 0; k < 1000; ++k) ASSERT_EQ(intake.energy(honest += 2e-3, true, 1), honest);
  double last = honest;
  for (const double mad : {1e300, std::numeric_limits<double>::infinity(), std::nan(""), -5.0, 1e9, 0.0}) {
    const double now = intake.energy(mad, true, 1);
    ASSERT_TRUE(std::isfinite(now));
    ASSERT_GE(now, last);
    last = now;
  }
  const double most = kLimits.torque * kLimits.velocity;
  EXPECT_LE(last - honest, most * 2.0 + 1e-9);  // what a gap may bring at once
  const double before = last;
  for (int k = 0; k < 10'000; ++k) last = intake.energy(1e12 * k, true, 1);
  EXPECT_LE(last - before, most * (2.0 + 10.0) + 1e-9);
}

TEST(Intake, ASumThatNoSessionReachesBeginsAtZero) {
  Intake<1> intake(kLimits, kDt);
  EXPECT_EQ(intake.energy(1e300, true, 1), 0.0);
  EXPECT_LE(intake.energy(1e300, true, 1), kLimits.torque * kLimits.velocity * 2 * kDt + 1e-12);
}

}  // namespace
}  // namespace farhand
