// Mass, spring and damper in closed form, in long double.
#pragma once

#include <cmath>

#include "common/integrate/matrix_exponential.hpp"

namespace farhand {

using Real = long double;

// x'' = -w2 x - 2 s x', by its roots: smooth through critical damping only to rounding, so it stays away from there.
struct Oscillator {
  Real omega2, sigma;  // 2 sigma = damping / J
  // Phi, row by row.
  SquareMatrix<Real, 2> at(Real t) const {
    const Real d2 = sigma * sigma - omega2;
    Real c, s;  // e^(-sigma t) cosh(d t), e^(-sigma t) sinh(d t) / d
    if (d2 > 0) {
      const Real d = std::sqrt(d2), fast = std::exp(-(sigma + d) * t), slow = std::exp(-omega2 / (sigma + d) * t);
      c = (fast + slow) / 2, s = (slow - fast) / (2 * d);
    } else if (d2 < 0) {
      const Real d = std::sqrt(-d2), decay = std::exp(-sigma * t);
      c = decay * std::cos(d * t), s = decay * std::sin(d * t) / d;
    } else {
      c = std::exp(-sigma * t), s = c * t;
    }
    return {{{c + sigma * s, s}, {-omega2 * s, c - sigma * s}}};
  }
};

}  // namespace farhand
