// Data that a step of a method leaves: its stages, from which the path between its ends follows, and values that a
// second step from the same start can use again.
#pragma once

#include <array>
#include <cstddef>

#include "common/integrate/method.hpp"
#include "common/integrate/plant.hpp"

namespace farhand {

// The states over the last step as polynomials of theta = (t - begin) / length, 0 to 1.
template <std::size_t kStates>
struct DenseOutput {
  using State = std::array<double, kStates>;
  std::array<State, 5> c{};

  State at(double theta) const noexcept {
    State x;
    for (std::size_t i = 0; i < kStates; ++i)
      x[i] = c[0][i] + theta * (c[1][i] + theta * (c[2][i] + theta * (c[3][i] + theta * c[4][i])));
    return x;
  }
};

template <Plant P>
struct Work {
  using State = typename P::State;

  // Call after the state, the time, the mode or an input has changed.
  void moved() noexcept { slope_known = jacobian_known = false; }

  const State& start_slope(const P& plant, Mode mode, double t, const State& x) noexcept {
    if (!slope_known) slope = derivative(plant, mode, t, x), slope_known = true;
    return slope;
  }
  const StateMatrix<P::kStates>& start_jacobian(const P& plant, Mode mode, double t, const State& x) noexcept {
    if (!jacobian_known) {
      start = plant.jacobian(mode, t, x), jacobian_known = true;
      ++counters.jacobians;
    }
    return start;
  }
  State derivative(const P& plant, Mode mode, double t, const State& x) noexcept {
    ++counters.derivatives;
    return plant.derivative(mode, t, x);
  }

  std::array<State, 7> k{};         // stages
  State error{};                    // of embedded methods: estimate of the error of the step
  State slope{};                    // where the step begins
  StateMatrix<P::kStates> start{};  // Jacobian there
  bool slope_known = false, jacobian_known = false;
  IntegratorCounters counters{};
};

// x + a k
template <class State>
State along(const State& x, double a, const State& k) noexcept {
  State y;
  for (std::size_t i = 0; i < y.size(); ++i) y[i] = x[i] + a * k[i];
  return y;
}

}  // namespace farhand
