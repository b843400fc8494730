// Checks that the step is short enough for the stiffest contact of a plant. Beyond the limit an explicit method
// diverges, and the run would show a motion that no controller caused.
#pragma once

#include <algorithm>
#include <complex>
#include <limits>

#include "common/integrate/stiffness.hpp"

namespace farhand {

// The longest step at which a method neither amplifies a motion of this eigenvalue nor makes it oscillate; +inf if
// there is no limit.
double longest_step(Method method, std::complex<double> eigenvalue);
// Throws std::invalid_argument with the limit and the value.
void check_step(Method method, double step, double longest);

template <Plant P>
void check_stable(const P& plant, Method method, double step) {
  double longest = std::numeric_limits<double>::infinity();
  for (const Situation<P>& s : plant.situations())
    longest = std::min(longest, longest_step(method, fastest_eigenvalue(plant, s.mode, s.t, s.x)));
  check_step(method, step, longest);
}

}  // namespace farhand
