// Bisection for the boundary of a predicate.
#pragma once

#include <cmath>

namespace farhand {

// The boundary p in [lowest, highest] up to which holds(p) is true. It is bracketed in steps of the ratio `step`, and
// the bracket is halved, on a logarithmic scale, down to rounding. Returns 0 if holds fails at `lowest` already, and
// `highest` if it never fails.
template <class Holds>
double first_failure(const Holds& holds, double lowest, double highest, double step = 1.05, int halvings = 50) {
  if (!holds(lowest)) return 0.0;
  double good = lowest, bad = lowest;
  do {
    if (good >= highest) return highest;
    bad = std::fmin(good * step, highest);
    if (!holds(bad)) break;
    good = bad;
  } while (true);
  for (int i = 0; i < halvings; ++i) {
    const double middle = std::sqrt(good * bad);
    (holds(middle) ? good : bad) = middle;
  }
  return good;
}

}  // namespace farhand
