// Blocks over one signal against their closed forms.
#include <gtest/gtest.h>

#include <cmath>

#include "common/signal/delay_line.hpp"
#include "common/signal/derivative.hpp"
#include "common/signal/low_pass.hpp"

namespace farhand {
namespace {

using J1 = Joints<1>;

TEST(Cutoff, HertzAndRadiansAgree) { EXPECT_DOUBLE_EQ(Cutoff::hz(50.0).rad_s(), 2.0 * std::numbers::pi * 50.0); }

TEST(LowPass, StepFollowsTheBackwardEulerClosedForm) {
  LowPass<1> filter(Cutoff::rad_s(200), 1e-3);
  for (int k = 1; k <= 50; ++k) {
    EXPECT_NEAR(filter.step(J1(0.5))[0], 0.5 * (1.0 - std::pow(1.2, -k)), 1e-15) << k;
  }
}

TEST(LowPass, RampLagIsExactlyOneOverG) {
  for (const double g : {1.0, 100.0, 1000.0, 20000.0}) {
    LowPass<1> filter(Cutoff::rad_s(g), 1e-3);
    double t = 0.0;
    for (int k = 0; k < 40000; ++k) filter.step(J1(t = 1e-3 * k));
    EXPECT_NEAR(t - filter.value()[0], 1.0 / g, 1e-9) << g;
  }
}

TEST(LowPass, IsMonotoneFarAboveTheNyquistRate) {
  LowPass<2> filter(Cutoff::rad_s(1e9), 1e-3);
  const Joints<2> y = filter.step(Joints<2>(1.0, -2.0));
  EXPECT_NEAR(y[0], 1.0, 1e-5);
  EXPECT_NEAR(y[1], -2.0, 1e-5);
}

TEST(Derivative, EqualsTheFilteredDifferenceQuotient) {
  const double dt = 1e-3, g = 500;
  Derivative<1> derivative(Cutoff::rad_s(g), dt);
  LowPass<1> filter(Cutoff::rad_s(g), dt);
  double previous = 0.0;
  for (int k = 1; k < 2000; ++k) {
    const double x = 0.25 * std::sin(3.0 * dt * k) + 1e-4 * ((k * 7919) % 13);
    EXPECT_NEAR(derivative.step(J1(x))[0], filter.step(J1((x - previous) / dt))[0], 1e-12);
    previous = x;
  }
}

TEST(Derivative, StartsAtRestWhereTheAxisIs) {
  Derivative<1> derivative(Cutoff::rad_s(500), 1e-3);
  derivative.reset(J1(0.3));
  EXPECT_EQ(derivative.step(J1(0.3))[0], 0.0);
}

TEST(Derivative, AMissedTickIsNotASpike) {
  const double dt = 1e-3, v = 0.7;
  Derivative<1> derivative(Cutoff::rad_s(500), dt);
  int k = 0;
  for (; k < 200; ++k) derivative.step(J1(v * dt * k));
  k += 25;  // the last was k - 26
  EXPECT_NEAR(derivative.across(J1(v * dt * k), 26)[0], v, 1e-9);
  for (int i = 1; i < 20; ++i) EXPECT_NEAR(derivative.step(J1(v * dt * (k + i)))[0], v, 1e-9);
}

TEST(Derivative, AcrossAGapIsSoManyStepsOnAStraightLine) {
  for (const int ticks : {2, 3, 9, 90}) {
    Derivative<1> at_once(Cutoff::rad_s(500), 1e-3), stepped = at_once;
    for (const double x : {0.1, 0.11, 0.107}) at_once.step(J1(x)), stepped.step(J1(x));
    EXPECT_NEAR(at_once.last()[0], 0.107, 1e-15);
    at_once.across(J1(0.2), ticks);
    for (int k = 1; k <= ticks; ++k) stepped.step(J1(0.107 + (0.2 - 0.107) * k / ticks));
    EXPECT_NEAR(at_once.value()[0], stepped.value()[0], 1e-12);
    EXPECT_NEAR(at_once.step(J1(0.2))[0], stepped.step(J1(0.2))[0], 1e-12);
  }
}

TEST(DelayLine, DelaysByWholeSamplesFromAnyCapacity) {
  for (std::size_t samples = 0; samples < 16; ++samples) {
    DelayLine<int, 16> line(samples, -1);
    for (int k = 0; k < 100; ++k) {
      const int expected = k < static_cast<int>(samples) ? -1 : k - static_cast<int>(samples);
      EXPECT_EQ(line.step(k), expected);
    }
  }
  EXPECT_EQ((DelayLine<int, 4>(99).samples()), 3u);
}

}  // namespace
}  // namespace farhand
