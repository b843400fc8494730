// Where observers and force loop cease to be stable, in theory and in the blocks themselves: the station's drive on an
// axis that moves exactly.
#include "common/analysis/side_loop.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "common/analysis/bisect.hpp"
#include "netem/lab/simulated_limits.hpp"

namespace farhand {
namespace {

// The same of the blocks.
template <class Set>
double limit_of_blocks(const SideLoop& loop, double expected, const Set& set) {
  return simulated_limit(expected, [&](double g_dt) {
    SideLoop tried = loop;
    set(tried, g_dt);
    return comes_to_rest(tried);
  });
}

// g dt from 0.01 to 20, as the maps.
template <class Set>
double computed_limit(const SideLoop& loop, const Set& set) {
  return first_failure(
      [&](double g_dt) {
        SideLoop tried = loop;
        set(tried, g_dt);
        return spectral_radius(tried) < 1.0;
      },
      0.01, 20.0);
}

constexpr double kDt = 1e-3, kJ = 4e-3;
const auto set_g_dis = [](SideLoop& loop, double g_dt) { loop.g_dis = g_dt / loop.dt; };
const auto set_g_reac = [](SideLoop& loop, double g_dt) { loop.g_reac = g_dt / loop.dt; };

TEST(SideLoop, DobOnAFreeRotorHasItsLimitInClosedForm) {
  for (const double ratio : {0.1, 0.5, 1.0, 1.9, 2.0, 2.2, 2.5, 3.0, 4.0})
    for (const double g_v : {50.0, 500.0, 1e9}) {
      const SideLoop loop{.axis = {kJ, 0, 0}, .dt = kDt, .J_n = ratio * kJ, .g_v = g_v};
      const double limit = std::min(dob_limit(ratio), 20.0);
      EXPECT_NEAR(computed_limit(loop, set_g_dis), limit, 1e-6 * limit) << ratio << ' ' << g_v;
    }
}

TEST(SideLoop, DobLimitIsThatOfTheBlocks) {
  int limited = 0;
  for (const LoadedAxis& axis :
       {LoadedAxis{kJ, 0, 0}, LoadedAxis{kJ, 0.5, 0}, LoadedAxis{kJ, 0.022, 5}, LoadedAxis{kJ, 0.4, 1e3}})
    for (const double K_p : {0.0, 400.0})
      for (const double ratio : {0.7, 1.5, 2.2, 2.5, 3.0, 4.0}) {
        const SideLoop loop{.axis = axis, .dt = kDt, .J_n = ratio * kJ, .K_p = K_p, .K_d = K_p / 10};
        const double limit = computed_limit(loop, set_g_dis);
        SCOPED_TRACE(testing::Message() << "k " << axis.k << " b " << axis.b << " K_p " << K_p << " J_n/J " << ratio
                                        << " limit " << limit);
        if (limit == 20.0) {
          SideLoop at_the_end = loop;
          set_g_dis(at_the_end, 20.0);
          EXPECT_TRUE(comes_to_rest(at_the_end));
        } else if (limit == 0.0) {
          SideLoop at_the_start = loop;
          set_g_dis(at_the_start, 0.01);
          EXPECT_FALSE(comes_to_rest(at_the_start, 60'000));
        } else {
          EXPECT_NEAR(limit_of_blocks(loop, limit, set_g_dis), limit, 0.02 * limit);
          ++limited;
        }
      }
  EXPECT_GE(limited, 20);
}

TEST(SideLoop, RtobLimitInContactIsThatOfTheBlocks) {
  int limited = 0;
  for (const LoadedAxis& axis :
       {LoadedAxis{kJ, 0.022, 5}, LoadedAxis{kJ, 0.1, 100}, LoadedAxis{kJ, 0.4, 1e3}, LoadedAxis{kJ, 0.6, 3e3}})
    for (const double force : {1.0, 2.0})  // K_f J
      for (const double ratio : {0.5, 1.0, 1.5, 2.0, 2.5}) {
        SideLoop loop{.axis = axis, .dt = kDt, .J_n = ratio * kJ, .viscous = 0.002, .K_p = 400, .K_d = 40};
        loop.K_f = force / kJ;
        const double limit = computed_limit(loop, set_g_reac);
        SCOPED_TRACE(testing::Message() << "k " << axis.k << " K_f J " << force << " J_n/J " << ratio << " limit "
                                        << limit);
        if (limit == 20.0) {
          set_g_reac(loop, 20.0);
          EXPECT_TRUE(comes_to_rest(loop));
        } else if (limit == 0.0) {
          set_g_reac(loop, 0.01);
          EXPECT_FALSE(comes_to_rest(loop, 60'000));
        } else {
          EXPECT_NEAR(limit_of_blocks(loop, limit, set_g_reac), limit, 0.02 * limit);
          ++limited;
        }
      }
  EXPECT_GE(limited, 12);
}

// A fixed generator and its own transform: the same points everywhere.
double uniform(std::uint64_t& state) {
  state = state * 6364136223846793005u + 1442695040888963407u;
  return static_cast<double>(state >> 11) * 0x1p-53;
}

TEST(SideLoop, SpectralRadiusTellsWhatTheBlocksDoAnywhere) {
  std::uint64_t state = 1;
  int stable = 0, unstable = 0;
  for (int i = 0; i < 400; ++i) {
    const double dt = 1e-4 * std::pow(100, uniform(state));
    SideLoop loop{.axis = {kJ, 0.002 + 0.5 * uniform(state), i % 3 == 0 ? 0.0 : std::pow(10, 4 * uniform(state))},
                  .dt = dt};
    loop.J_n = kJ * 0.1 * std::pow(40, uniform(state));
    loop.viscous = 0.002;
    loop.K_p = 10 * std::pow(1000, uniform(state));
    loop.K_d = 2 * std::sqrt(loop.K_p);
    loop.K_f = i % 2 == 0 ? 0.0 : 1000 * uniform(state);
    loop.g_dis = 0.01 / dt * std::pow(2000, uniform(state));
    loop.g_reac = 0.01 / dt * std::pow(2000, uniform(state));
    loop.g_v = 0.1 / dt * std::pow(100, uniform(state));
    const double radius = spectral_radius(loop);
    if (std::abs(radius - 1.0) < 2e-3) continue;  // too slow to be seen
    EXPECT_EQ(comes_to_rest(loop), radius < 1.0) << i << ": " << radius;
    ++(radius < 1.0 ? stable : unstable);
  }
  EXPECT_GT(stable, 50);
  EXPECT_GT(unstable, 50);
}

}  // namespace
}  // namespace farhand
