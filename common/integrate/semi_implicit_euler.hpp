// Semi-implicit (symplectic) Euler: velocities first, then positions with the new velocities. Order 1; an undamped mode
// of omega keeps its amplitude while omega h < 2; the explicit Euler method would let it grow at every step.
#pragma once

#include "common/integrate/step_work.hpp"

namespace farhand {

// States are positions, each followed by its velocity, then other states; a plant with another arrangement declares
// kPositions.
template <Plant P>
constexpr bool is_position(std::size_t state) {
  if constexpr (requires { P::kPositions[state]; })
    return P::kPositions[state];
  else
    return state % 2 == 0 && state + 1 < P::kStates;
}

struct SemiImplicitEuler {
  static constexpr int kOrder = 1;
  static constexpr const char* kName = "semi-implicit Euler";
  static constexpr Method kMethod = Method::kSemiImplicitEuler;
  static constexpr bool kEmbedded = false;

  template <Plant P>
  static bool step(const P& plant, Mode mode, double t, const typename P::State& x, double h, typename P::State& y,
                   Work<P>& work) noexcept {
    const auto& k = work.k[0] = work.start_slope(plant, mode, t, x);
    y = x;
    for (std::size_t i = 0; i < P::kStates; ++i)
      if (!is_position<P>(i)) y[i] += h * k[i];
    const auto moved = work.derivative(plant, mode, t, y);
    for (std::size_t i = 0; i < P::kStates; ++i)
      if (is_position<P>(i)) y[i] += h * moved[i];
    return true;
  }

  // A shorter step from the same start ends on this path (exactly so where a position's rate is a velocity).
  template <Plant P>
  static DenseOutput<P::kStates> dense(const typename P::State& x, double h, const typename P::State& y,
                                       const Work<P>& work) noexcept {
    DenseOutput<P::kStates> path;
    path.c[0] = x;
    for (std::size_t i = 0; i < P::kStates; ++i) {
      path.c[1][i] = h * work.k[0][i];
      path.c[2][i] = y[i] - x[i] - path.c[1][i];
    }
    return path;
  }
};

}  // namespace farhand
