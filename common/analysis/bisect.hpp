// Where does something that holds cease to hold?
#pragma once

#include <cmath>

namespace farhand {

// The first p in [lowest, highest], on a scale of ratios, at which holds(p) fails: looked for in ratios of step, then
// halved to rounding. 0 if it fails at lowest already, highest if it never does.
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
