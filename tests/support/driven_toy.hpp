// The toy axis in a hand that moves as a therapist's does, and Runge-Kutta to hold it against.
#pragma once

#include <numbers>

#include "tests/support/affine_toys.hpp"

namespace farhand {

// Minimum jerk from `from` to `to`, a sine, rest: what the intended movements are.
inline std::vector<Forcing<double>> movements() {
  const double d = 0.3, D = 0.8;
  return {{0, {0.05}, 0, 0, 0},
          {0.3, {0.05, 0, 0, 10 * d / (D * D * D), -15 * d / (D * D * D * D), 6 * d / (D * D * D * D * D)}, 0, 0, 0},
          {1.1, {0.35}, 2 * std::numbers::pi * 1.7, 0.1, 0.02},
          {1.9, {0.35}, 0, 0, 0}};
}
inline ToyPlant driven() { return {.J = 0.005, .viscous = 0.06, .arm = 3, .contacts = {}, .motion = movements()}; }

// Runge-Kutta of order 4, within the mode given.
inline std::array<double, 2> runge_kutta(const ToyPlant& plant, Mode mode, double t0, double t1,
                                         std::array<double, 2> x, int steps) {
  const double h = (t1 - t0) / steps;
  const auto along = [&x](double length, const std::array<double, 2>& k) {
    return std::array<double, 2>{x[0] + length * k[0], x[1] + length * k[1]};
  };
  for (int i = 0; i < steps; ++i) {
    const double t = t0 + i * h;
    const auto k1 = plant.derivative(mode, t, x);
    const auto k2 = plant.derivative(mode, t + h / 2, along(h / 2, k1));
    const auto k3 = plant.derivative(mode, t + h / 2, along(h / 2, k2));
    const auto k4 = plant.derivative(mode, t + h * (1 - 1e-9), along(h, k3));  // before the break
    for (std::size_t j = 0; j < 2; ++j) x[j] += h / 6 * (k1[j] + 2 * (k2[j] + k3[j]) + k4[j]);
  }
  return x;
}

}  // namespace farhand
