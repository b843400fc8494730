// Where observers and force loop cease to be stable, in theory and in the blocks themselves: the station's drive on an
// axis that moves exactly.
#include "common/analysis/side_loop.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "common/analysis/bisect.hpp"
#include "common/scene/drive.hpp"

namespace farhand {
namespace {

// J x'' + b x' + k x = tau over one period of held torque: Taylor series over parts of it.
class ExactAxis {
 public:
  ExactAxis(const Axis& axis, double dt)
      : axis_(axis),
        parts_(1 + static_cast<int>(4 * dt * (std::sqrt(axis.k / axis.J) + axis.b / axis.J))),
        h_(dt / parts_) {}
  void advance(double tau) {
    for (int i = 0; i < parts_; ++i) {
      double dx = v_, dv = acceleration(x_, v_, tau), factor = h_, x = x_, v = v_;
      for (int order = 1; order <= 8; ++order) {
        x += factor * dx;
        v += factor * dv;
        const double next = (-axis_.b * dv - axis_.k * dx) / axis_.J;
        dx = dv;
        dv = next;
        factor *= h_ / (order + 1);
      }
      x_ = x, v_ = v;
    }
  }
  double x_ = 0, v_ = 0;

 private:
  double acceleration(double x, double v, double tau) const { return (tau - axis_.b * v - axis_.k * x) / axis_.J; }
  Axis axis_;
  int parts_;
  double h_;
};

DirectDrive<1> drive_of(const SideLoop& loop) {
  DriveParams p;
  p.model = {.J_n = loop.J_n, .viscous = loop.viscous};
  p.K = {loop.K_p, loop.K_d, loop.K_f};
  p.g_dis = Cutoff::rad_s(loop.g_dis);
  p.g_reac = Cutoff::rad_s(loop.g_reac);
  p.g_v = Cutoff::rad_s(loop.g_v);
  p.gate = {.torque = 1e12, .torque_rate = 1e15, .velocity = 1e9, .range_min = -1e12, .range_max = 1e12};
  p.take_over_s = loop.dt;
  p.dt_s = loop.dt;
  return DirectDrive<1>(p);
}

// An axis that is pushed to 0.01 rad/s; the remote side stands still.
bool comes_to_rest(const SideLoop& loop, int ticks = 6000) {
  DirectDrive<1> drive = drive_of(loop);
  ExactAxis axis(loop.axis, loop.dt);
  drive.reset({Joints<1>(axis.x_), true});
  axis.v_ = 0.01;
  double middle = 0, end = 0;
  for (int n = 0; n < ticks; ++n) {
    const Motion<1> local = drive.observe({Joints<1>(axis.x_), true}, 1);
    axis.advance(drive.follow(local, Motion<1>{}, true, 1).torque[0]);
    if (!(std::abs(axis.v_) < 1e6)) return false;
    if (n >= ticks / 4) {
      double& most = n < ticks / 2 ? middle : end;
      most = std::max(most, std::abs(axis.v_));
    }
  }
  return end <= std::max(middle, 1e-9);  // below that is rounding
}

// By halving between a factor of two on both sides of where it should be.
template <class Set>
double simulated_limit(const SideLoop& loop, double expected, const Set& set) {
  double low = 0.5 * expected, high = 2 * expected;
  for (int i = 0; i < 8; ++i) {
    const double middle = std::sqrt(low * high);
    SideLoop tried = loop;
    set(tried, middle);
    (comes_to_rest(tried) ? low : high) = middle;
  }
  return std::sqrt(low * high);
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
  for (const Axis& axis : {Axis{kJ, 0, 0}, Axis{kJ, 0.5, 0}, Axis{kJ, 0.022, 5}, Axis{kJ, 0.4, 1e3}})
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
          EXPECT_NEAR(simulated_limit(loop, limit, set_g_dis), limit, 0.02 * limit);
          ++limited;
        }
      }
  EXPECT_GE(limited, 20);
}

TEST(SideLoop, RtobLimitInContactIsThatOfTheBlocks) {
  int limited = 0;
  for (const Axis& axis : {Axis{kJ, 0.022, 5}, Axis{kJ, 0.1, 100}, Axis{kJ, 0.4, 1e3}, Axis{kJ, 0.6, 3e3}})
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
          EXPECT_NEAR(simulated_limit(loop, limit, set_g_reac), limit, 0.02 * limit);
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
