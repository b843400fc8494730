// RK4: its order, its stability region, and that it ends where it is told to.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>

#include "common/integrate/rk4.hpp"

namespace farhand {
namespace {

struct Oscillator {
  using State = std::array<double, 2>;
  double omega;
  State derivative(double, const State& s) const noexcept { return {s[1], -omega * omega * s[0]}; }
};

// The same, driven at another frequency: time enters the derivative as well.
struct Driven {
  using State = Eigen::Vector2d;
  State derivative(double t, const State& s) const noexcept { return {s[1], -9.0 * s[0] + std::sin(2.0 * t)}; }
  static double exact(double t) { return (std::sin(2.0 * t) - 2.0 / 3.0 * std::sin(3.0 * t)) / 5.0; }
};

// Least squares slope of log(error) over log(h).
template <class Error>
double fitted_order(Error error) {
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (double h = 0.02; h > 1e-3; h /= 2.0) {
    const double x = std::log(h), y = std::log(error(h));
    n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y;
  }
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

TEST(Rk4, IsOfOrderFour) {
  const double order = fitted_order([](double h) {
    Oscillator::State s{1.0, 0.0};
    rk4_advance(Oscillator{5.0}, s, 0.0, 2.0, h);
    return std::hypot(s[0] - std::cos(10.0), s[1] / 5.0 + std::sin(10.0));
  });
  EXPECT_NEAR(order, 4.0, 0.1);
  RecordProperty("order", std::to_string(order));
  std::printf("order on the oscillator: %.4f\n", order);
}

TEST(Rk4, IsOfOrderFourWhenTimeDrivesThePlantAndTheStateIsEigen) {
  const double order = fitted_order([](double h) {
    Eigen::Vector2d s = Eigen::Vector2d::Zero();
    rk4_advance(Driven{}, s, 0.0, 2.0, h);
    return std::fabs(s[0] - Driven::exact(2.0));
  });
  EXPECT_NEAR(order, 4.0, 0.1);
  std::printf("order on the driven oscillator: %.4f\n", order);
}

TEST(Rk4, IntegratesCubicsExactly) {
  struct Cubic {
    using State = std::array<double, 1>;
    State derivative(double t, const State&) const noexcept { return {4.0 * t * t * t - 3.0 * t * t + 1.0}; }
  };
  Cubic::State s{0.0};
  rk4_advance(Cubic{}, s, 0.0, 2.0, 0.7);
  EXPECT_NEAR(s[0], 16.0 - 8.0 + 2.0, 1e-13);
}

TEST(Rk4, EndsExactlyAtTheEndWithTheFewestStepsAllowed) {
  struct Probe {
    using State = std::array<double, 1>;
    mutable int calls = 0;
    mutable double last = 0;
    State derivative(double t, const State&) const noexcept {
      ++calls, last = t;
      return {1.0};
    }
  };
  struct Case {
    double t0, t1, step;
    int steps;
  };
  for (const Case c : {Case{0, 1e-3, 50e-6, 20}, Case{3600, 3600.001, 50e-6, 20}, Case{1e6, 1e6 + 1e-3, 50e-6, 20},
                       Case{0, 1e-3, 1.0, 1}, Case{0, 1e-3, 0.9e-3, 2}, Case{2, 2, 50e-6, 0}, Case{2, 1, 50e-6, 0}}) {
    Probe probe;
    Probe::State s{0.0};
    rk4_advance(probe, s, c.t0, c.t1, c.step);
    EXPECT_EQ(probe.calls, 4 * c.steps) << c.t0;
    if (c.steps > 0) {
      EXPECT_NEAR(probe.last, c.t1, 4e-16 * c.t1);
      EXPECT_NEAR(s[0], c.t1 - c.t0, 1e-15);
    }
  }
}

// |R(z)| <= 1 for R(z) = 1 + z + z^2/2 + z^3/6 + z^4/24 over the whole half disc, computed with the integrator itself.
TEST(Rk4, DampsEveryStableModeInsideItsStableRadius) {
  struct Mode {
    using State = std::array<double, 2>;
    std::complex<double> s;
    State derivative(double, const State& z) const noexcept {
      return {s.real() * z[0] - s.imag() * z[1], s.imag() * z[0] + s.real() * z[1]};
    }
  };
  double worst = 0;
  for (int angle = 90; angle <= 180; ++angle) {
    for (int r = 1; r <= 100; ++r) {
      const double radius = kRk4StableRadius * r / 100.0;
      const Mode mode{std::polar(radius, angle * std::numbers::pi / 180.0)};
      const auto z = rk4_step(mode, 0.0, {1.0, 0.0}, 1.0);
      worst = std::fmax(worst, std::hypot(z[0], z[1]));
    }
  }
  EXPECT_LE(worst, 1.0 + 1e-12);
  EXPECT_GT(std::abs([] {
              const auto z = rk4_step(Mode{{-2.9, 0.0}}, 0.0, {1.0, 0.0}, 1.0);
              return z[0];
            }()),
            1.0);
}

}  // namespace
}  // namespace farhand
