// How fast a second-order part of a plant can move: what the step of an explicit method is held against.
#pragma once

#include <cmath>

namespace farhand {

// Largest |s| of J s^2 + damping s + stiffness = 0, complex or real.
inline double oscillator_rate(double J, double stiffness, double damping) noexcept {
  const double d = 0.5 * damping / J, w2 = stiffness / J;
  return d * d > w2 ? d + std::sqrt(d * d - w2) : std::sqrt(w2);
}

}  // namespace farhand
