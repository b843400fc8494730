// The Rosenbrock method RODAS3 (Sandu et al. 1997): order 3, L-stable; its last stage is the result. A step solves four
// linear systems with one matrix and without iteration. The derivative by time is included, so that the order also
// holds for driven plants.
#pragma once

#include "common/integrate/lu.hpp"
#include "common/integrate/step_work.hpp"

namespace farhand {

struct Rosenbrock {
  static constexpr int kOrder = 3;
  static constexpr const char* kName = "Rosenbrock";
  static constexpr Method kMethod = Method::kRosenbrock;
  static constexpr bool kEmbedded = false;
  static constexpr double kGamma = 0.5;

  template <Plant P>
  static bool step(const P& plant, Mode mode, double t, const typename P::State& x, double h, typename P::State& y,
                   Work<P>& work) noexcept {
    const double a = kGamma * h;
    Lu<P::kStates> lu;
    if (!lu.factor(a, work.start_jacobian(plant, mode, t, x))) return false;
    const auto& f = work.start_slope(plant, mode, t, x);
    const auto f_t = plant.time_derivative(mode, t, x);
    typename P::State k1, k2, k3, k4;
    for (std::size_t i = 0; i < P::kStates; ++i) k1[i] = a * (f[i] + 0.5 * h * f_t[i]);
    lu.solve(k1);
    for (std::size_t i = 0; i < P::kStates; ++i) k2[i] = a * (f[i] + 1.5 * h * f_t[i]) + kGamma * 4.0 * k1[i];
    lu.solve(k2);
    y = along(x, 2.0, k1);
    const auto f3 = work.derivative(plant, mode, t + h, y);
    for (std::size_t i = 0; i < P::kStates; ++i) k3[i] = a * f3[i] + kGamma * (k1[i] - k2[i]);
    lu.solve(k3);
    y = along(y, 1.0, k3);
    const auto& f4 = work.k[0] = work.derivative(plant, mode, t + h, y);
    for (std::size_t i = 0; i < P::kStates; ++i) k4[i] = a * f4[i] + kGamma * (k1[i] - k2[i] - 8.0 / 3.0 * k3[i]);
    lu.solve(k4);
    y = along(y, 1.0, k4);
    return true;
  }

  // Of second order, through both ends with the slope of the last stage; as in SDIRK2 none from the start.
  template <Plant P>
  static DenseOutput<P::kStates> dense(const typename P::State& x, double h, const typename P::State& y,
                                       const Work<P>& work) noexcept {
    DenseOutput<P::kStates> path;
    path.c[0] = x;
    for (std::size_t i = 0; i < P::kStates; ++i) {
      path.c[2][i] = h * work.k[0][i] - (y[i] - x[i]);
      path.c[1][i] = y[i] - x[i] - path.c[2][i];
    }
    return path;
  }
};

}  // namespace farhand
