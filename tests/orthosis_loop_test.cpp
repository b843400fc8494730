// The orthosis' loop in theory against the MCU's law in double precision on a joint that moves exactly.
#include "common/analysis/orthosis_loop.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "common/analysis/bisect.hpp"
#include "tests/support/mcu_reference.hpp"

namespace farhand {
namespace {

// Joint, motor and spring over one period of a held velocity command: Taylor series over half of it.
class ExactOrthosis {
 public:
  explicit ExactOrthosis(const OrthosisLoop& p) : p_(p) {}
  using State = std::array<double, 4>;  // x, v, motor angle, motor speed

  void advance(double u) {
    constexpr int kParts = 2;
    for (int i = 0; i < kParts; ++i) {
      State next = s, term = slope(s, u);
      double factor = p_.dt / kParts;
      for (int order = 1; order <= 10; ++order) {
        for (std::size_t j = 0; j < 4; ++j) next[j] += factor * term[j];
        term = slope(term, 0.0);
        factor *= p_.dt / kParts / (order + 1);
      }
      s = next;
    }
  }
  State s{};

 private:
  State slope(const State& y, double u) const {
    return {y[1], (p_.spring * (y[2] - y[0]) - p_.axis.b * y[1] - p_.axis.k * y[0]) / p_.axis.J, y[3],
            p_.motor_rate * (u - y[3])};
  }
  OrthosisLoop p_;
};

bool comes_to_rest(const OrthosisLoop& loop) {
  mcu::McuSettings settings;
  settings.loop_hz = 1.0 / loop.dt;
  settings.spring = loop.spring;
  settings.J_n = loop.J_n;
  settings.viscous = loop.viscous;
  settings.K_p = loop.K_p, settings.K_d = loop.K_d, settings.K_f = loop.K_f;
  settings.g = loop.g, settings.g_v = loop.g_v;
  settings.spring_gain = loop.spring_gain;
  settings.torque_rate_limit = 1e15;
  settings.motor_speed_limit = 1e12;
  settings.power_limit = settings.velocity_limit = settings.torque_limit = settings.range_max = 1e12;  // the law alone
  settings.range_min = -1e12;
  mcu::McuReference law(settings);
  ExactOrthosis plant(loop);
  law.estimate(0.0, 0.0);
  plant.s[1] = 0.01;
  constexpr int kLoops = 8'000;
  double middle = 0, end = 0;
  for (int n = 0; n < kLoops; ++n) {
    law.estimate(plant.s[0], plant.s[2]);
    plant.advance(law.control(0.0, 0.0, 0.0, 1e12));
    if (!(std::abs(plant.s[1]) < 1e6)) return false;
    double& most = n < kLoops / 2 ? middle : end;
    if (n >= kLoops / 4) most = std::max(most, std::abs(plant.s[1]));
  }
  return end <= std::max(middle, 1e-9);
}

TEST(OrthosisLoop, ForceGainLimitIsThatOfTheLaw) {
  int limited = 0;
  for (const double k : {0.0, 2.0, 5.0, 20.0, 50.0})
    for (const double gain : {5.0, 10.0})
      for (const double ratio : {0.6, 0.8, 1.0}) {
        OrthosisLoop loop{.axis = {4e-3, 0.022, k}, .spring_gain = gain, .J_n = ratio * 4e-3, .viscous = 0.002};
        const auto stable = [&](double K_f) {
          loop.K_f = K_f;
          return spectral_radius(loop) < 1.0;
        };
        const double limit = first_failure(stable, 10.0, 20'000.0);
        SCOPED_TRACE(testing::Message() << "k " << k << " gain " << gain << " J_n/J " << ratio << " limit " << limit);
        if (limit == 0.0 || limit == 20'000.0) {
          loop.K_f = std::max(10.0, limit);
          if (std::abs(spectral_radius(loop) - 1.0) < 5e-4) continue;
          EXPECT_EQ(comes_to_rest(loop), limit > 0.0);
          continue;
        }
        double low = 0.5 * limit, high = 2.0 * limit;
        for (int i = 0; i < 8; ++i) {
          loop.K_f = std::sqrt(low * high);
          (comes_to_rest(loop) ? low : high) = loop.K_f;
        }
        EXPECT_NEAR(std::sqrt(low * high), limit, 0.02 * limit);
        ++limited;
      }
  EXPECT_GE(limited, 20);
}

}  // namespace
}  // namespace farhand
