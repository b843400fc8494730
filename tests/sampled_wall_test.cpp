// Limits of a sampled wall, each against a way that shares nothing with how it was computed: stability against the
// growth of the motion of a device at the wall, passivity against the energy that a hand draws from the wall.
#include <gtest/gtest.h>

#include <vector>

#include "netem/lab/simulated_limits.hpp"

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

TEST(SampledWall, StabilityLimitIsWhereTheSimulatedDeviceStopsComingToRest) {
  int checked = 0;
  for (const SampledWall& wall : combinations()) {
    const double limit = stability_limit(wall);
    ASSERT_GT(limit, 0);
    EXPECT_NEAR(simulated_limit(
                    limit, [&](double K) { return dies_out(wall, K); }, 9),
                limit, 0.01 * limit)
        << "J " << wall.J << " b " << wall.b << " T " << wall.T << " B " << wall.B;
    ++checked;
  }
  EXPECT_GE(checked, 20);
}

TEST(SampledWall, PassivityLimitIsWhereAHandBeginsToDrawEnergy) {
  int checked = 0;
  for (const SampledWall& wall : combinations()) {
    const double limit = passivity_limit(wall);
    ASSERT_GT(limit, 0);
    EXPECT_NEAR(passivity_limit_closed_form(wall), limit, 1e-6 * limit);
    EXPECT_NEAR(simulated_limit(
                    limit, [&](double K) { return least_energy(wall, K, Between::kStraight) > 0; }, 9),
                limit, 0.01 * limit)
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
