// Limits of a sampled wall, each against a way that shares nothing with how it was computed: stability against the
// growth of the motion of a device at the wall, passivity against the energy that a hand draws from the wall.
#include "common/analysis/sampled_wall.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

namespace farhand {
namespace {

// J from the smallest to the largest device, light to heavy friction, 4 kHz to 250 Hz; half of them with B > 0.
std::vector<SampledWall> combinations() {
  std::vector<SampledWall> walls;
  for (const double J : {5e-4, 4e-3, 0.1})
    for (const double friction : {0.5, 12.5, 60.0})  // b/J, 1/s
      for (const double T : {2.5e-4, 1e-3, 4e-3})
        for (const double share : {0.0, 0.4}) walls.push_back({J, friction * J, T, share * friction * J});
  return walls;
}

// A device let go at rest, 1 mrad inside the wall. Its motion under a held torque is a sum of exponentials:
// v -> v_end + (v - v_end) e^{-t b/J}.
bool dies_out(const SampledWall& wall, double K) {
  constexpr int kTicks = 60'000;
  const double decay = std::exp(-wall.T * wall.b / wall.J), lost = -std::expm1(-wall.T * wall.b / wall.J);
  double x = 1e-3, v = 0, x_before = x, middle = 0, end = 0;
  for (int n = 0; n < kTicks; ++n) {
    const double tau = -K * x - wall.B * (x - x_before) / wall.T;
    x_before = x;
    const double v_end = tau / wall.b, over = v - v_end;
    x += v_end * wall.T + over * lost * wall.J / wall.b;
    v = v_end + over * decay;
    if (std::abs(x) > 1e3) return false;
    double& most = n < kTicks / 2 ? middle : end;
    if (n >= kTicks / 4) most = std::max(most, std::abs(x));
  }
  return end < middle;
}

TEST(SampledWall, StabilityLimitIsWhereTheSimulatedDeviceStopsComingToRest) {
  int checked = 0;
  for (const SampledWall& wall : combinations()) {
    const double limit = stability_limit(wall);
    ASSERT_GT(limit, 0);
    double low = 0.5 * limit, high = 2 * limit;
    for (int i = 0; i < 9; ++i) {
      const double middle = 0.5 * (low + high);
      (dies_out(wall, middle) ? low : high) = middle;
    }
    EXPECT_NEAR(0.5 * (low + high), limit, 0.01 * limit)
        << "J " << wall.J << " b " << wall.b << " T " << wall.T << " B " << wall.B;
    ++checked;
  }
  EXPECT_GE(checked, 20);
}

enum class Between { kStraight, kSine };

// Energy that a hand puts into device and wall over whole periods of a motion whose samples are cos(theta n), in
// N m per rad^2. Between the samples it moves straight, which of all motions through them loses least to friction, or
// as a sine.
double energy_put_in(const SampledWall& wall, double K, double theta, int samples, Between between) {
  constexpr double kPhase = 0.3;  // sampled at its zeros a sine of half the sampling rate would not be seen
  const auto x = [&](double n) { return std::cos(theta * n + kPhase); };
  double energy = 0;
  for (int n = 0; n < samples; ++n) {
    const double tau = -K * x(n) - wall.B * (x(n) - x(n - 1)) / wall.T;
    const int parts = between == Between::kSine ? 16 : 1;
    for (int i = 0; i < parts; ++i) {
      const double moved =
          between == Between::kSine ? x(n + (i + 1.0) / parts) - x(n + double(i) / parts) : x(n + 1) - x(n);
      energy += (wall.b * moved * parts / wall.T - tau) * moved;
    }
  }
  return energy;
}

// The least over the frequencies of 100 samples.
double least_energy(const SampledWall& wall, double K, Between between) {
  constexpr int kSamples = 100;
  double least = std::numeric_limits<double>::infinity();
  for (int periods = 1; periods <= kSamples / 2; ++periods)
    least = std::min(least, energy_put_in(wall, K, 2 * std::numbers::pi * periods / kSamples, kSamples, between));
  return least;
}

TEST(SampledWall, PassivityLimitIsWhereAHandBeginsToDrawEnergy) {
  int checked = 0;
  for (const SampledWall& wall : combinations()) {
    const double limit = passivity_limit(wall);
    ASSERT_GT(limit, 0);
    EXPECT_NEAR(passivity_limit_closed_form(wall), limit, 1e-6 * limit);
    double low = 0.5 * limit, high = 2 * limit;
    for (int i = 0; i < 9; ++i) {
      const double middle = 0.5 * (low + high);
      (least_energy(wall, middle, Between::kStraight) > 0 ? low : high) = middle;
    }
    EXPECT_NEAR(0.5 * (low + high), limit, 0.01 * limit)
        << "J " << wall.J << " b " << wall.b << " T " << wall.T << " B " << wall.B;
    ++checked;
  }
  EXPECT_GE(checked, 20);
}

TEST(SampledWall, ASineDrawsNothingAtThePassivityLimit) {
  // pi^2/4 more friction is lost to a sine of half the sampling rate than to the straight motion through its samples.
  const SampledWall wall{4e-3, 0.05, 1e-3, 0.02};
  EXPECT_LT(least_energy(wall, 1.02 * passivity_limit(wall), Between::kStraight), 0);
  EXPECT_GT(least_energy(wall, 1.02 * passivity_limit(wall), Between::kSine), 0);
}

TEST(SampledWall, KnownValues) {
  const SampledWall undamped{4e-3, 0.05, 1e-3, 0}, damped{4e-3, 0.05, 1e-3, 0.02};
  EXPECT_NEAR(stability_limit(undamped), 100.2, 0.05);
  EXPECT_NEAR(stability_limit(damped), 139.6, 0.05);
  EXPECT_NEAR(passivity_limit(undamped), 100, 1e-3);
  EXPECT_NEAR(passivity_limit(damped), 60, 1e-3);
}

TEST(SampledWall, NegativeDampingCostsAsMuchPassivityAsPositive) {
  EXPECT_NEAR(passivity_limit({4e-3, 0.05, 1e-3, -0.02}), 60, 1e-3);
  EXPECT_EQ(passivity_limit({4e-3, 0.05, 1e-3, 0.06}), 0);
  EXPECT_EQ(passivity_limit_closed_form({4e-3, 0.05, 1e-3, 0.06}), 0);
}

TEST(SampledWall, NothingIsStableOnceTheDampingAloneOscillates) {
  // B T/J near 2 turns the velocity around within a sample.
  EXPECT_EQ(stability_limit({4e-3, 0.0, 1e-3, 9.0}), 0);
  EXPECT_GT(stability_limit({4e-3, 0.0, 1e-3, 1.0}), 0);
}

}  // namespace
}  // namespace farhand
