// Classic Runge-Kutta of order 4. A plant says how fast its state changes; the integrator advances it and knows nothing
// else, so that another method can stand in its place. Order 4 holds where the derivative is smooth: each contact that
// opens or closes within a step leaves an error of first order in that step.
#pragma once

#include <cmath>
#include <concepts>
#include <cstdint>

#include "common/integrate/step_work.hpp"

namespace farhand {

// State is anything of fixed size with size() and [], such as std::array<double, S> or a fixed Eigen vector.
template <class P>
concept SmoothPlant = requires(const P& plant, double t, const typename P::State& state) {
  { plant.derivative(t, state) }
  noexcept->std::same_as<typename P::State>;
};

// A mode of rate |s| (in 1/s) anywhere in the left half plane is damped by RK4 while |s| h stays below this.
constexpr double kRk4StableRadius = 2.6;

template <SmoothPlant P>
typename P::State rk4_step(const P& plant, double t, const typename P::State& x, double h) noexcept {
  using State = typename P::State;
  const auto along = [&x](double length, const State& slope) noexcept {
    State y = x;
    for (decltype(y.size()) i = 0; i < y.size(); ++i) y[i] += length * slope[i];
    return y;
  };
  const State k1 = plant.derivative(t, x);
  const State k2 = plant.derivative(t + 0.5 * h, along(0.5 * h, k1));
  const State k3 = plant.derivative(t + 0.5 * h, along(0.5 * h, k2));
  const State k4 = plant.derivative(t + h, along(h, k3));
  State y = x;
  for (decltype(y.size()) i = 0; i < y.size(); ++i) y[i] += h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]);
  return y;
}

// From t0 to exactly t1 in equal steps, the fewest that are not longer than max_step > 0. Nothing happens unless t1 >
// t0. A step may be a millionth longer than max_step: t1 - t0 is a difference of large numbers, and 20 steps must not
// become 21 by its rounding.
template <SmoothPlant P>
void rk4_advance(const P& plant, typename P::State& x, double t0, double t1, double max_step) noexcept {
  if (!(t1 > t0)) return;
  const double steps = std::fmax(1.0, std::ceil((t1 - t0) / max_step * (1.0 - 1e-6)));
  const double h = (t1 - t0) / steps;
  const auto count = static_cast<std::int64_t>(steps);
  for (std::int64_t i = 0; i < count; ++i) x = rk4_step(plant, t0 + static_cast<double>(i) * h, x, h);
}

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

  // Of third order from the same four stages, so that its error is of the order of the step's own.
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
