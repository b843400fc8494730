// Classic Runge-Kutta of order 4: four derivatives per step, no estimate of its error.
#pragma once

#include "common/integrate/step_work.hpp"

namespace farhand {

// A mode of rate |s| (in 1/s) anywhere in the left half plane is damped by RK4 while |s| h stays below this. On the
// negative real axis the limit is 2.785, on the imaginary axis 2.828.
constexpr double kRk4StableRadius = 2.6;

struct Rk4 {
  static constexpr int kOrder = 4;
  static constexpr const char* kName = "RK4";
  static constexpr Method kMethod = Method::kRk4;
  static constexpr bool kEmbedded = false;

  template <Plant P>
  static bool step(const P& plant, Mode mode, double t, const typename P::State& x, double h, typename P::State& y,
                   Work<P>& work) noexcept {
    auto& k = work.k;
    k[0] = work.start_slope(plant, mode, t, x);
    k[1] = work.derivative(plant, mode, t + 0.5 * h, along(x, 0.5 * h, k[0]));
    k[2] = work.derivative(plant, mode, t + 0.5 * h, along(x, 0.5 * h, k[1]));
    k[3] = work.derivative(plant, mode, t + h, along(x, h, k[2]));
    for (std::size_t i = 0; i < P::kStates; ++i)
      y[i] = x[i] + h / 6.0 * (k[0][i] + 2.0 * (k[1][i] + k[2][i]) + k[3][i]);
    return true;
  }

  // Interpolant of third order from the same four stages; its error is of the order of the step's own.
  template <Plant P>
  static DenseOutput<P::kStates> dense(const typename P::State& x, double h, const typename P::State&,
                                       const Work<P>& work) noexcept {
    DenseOutput<P::kStates> path;
    path.c[0] = x;
    for (std::size_t i = 0; i < P::kStates; ++i) {
      const double first = work.k[0][i], middle = work.k[1][i] + work.k[2][i], last = work.k[3][i];
      path.c[1][i] = h * first;
      path.c[2][i] = h * (middle - 1.5 * first - 0.5 * last);
      path.c[3][i] = h * 2.0 / 3.0 * (first - middle + last);
    }
    return path;
  }
};

}  // namespace farhand
