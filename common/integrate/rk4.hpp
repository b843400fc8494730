// Classic Runge-Kutta of order 4. A plant says how fast its state changes; the integrator advances it and knows nothing
// else, so that another method can stand in its place. Order 4 holds where the derivative is smooth: each contact that
// opens or closes within a step leaves an error of first order in that step.
#pragma once

#include <cmath>
#include <concepts>
#include <cstdint>

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

}  // namespace farhand
