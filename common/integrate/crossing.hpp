// Estimates where a guard falls below zero within a step, from its values at four points of the step. It is only a
// guess: the integrator takes real steps of the lengths that this returns.
#pragma once

#include <cmath>

namespace farhand {

// The cubic through the values at theta = 0, 1/3, 2/3 and 1.
struct GuardCubic {
  double c0, c1, c2, c3;

  static GuardCubic through(double g0, double g1, double g2, double g3) noexcept {
    return {g0, -5.5 * g0 + 9.0 * g1 - 4.5 * g2 + g3, 9.0 * g0 - 22.5 * g1 + 18.0 * g2 - 4.5 * g3,
            4.5 * (-g0 + 3.0 * (g1 - g2) + g3)};
  }
  double at(double theta) const noexcept { return c0 + theta * (c1 + theta * (c2 + theta * c3)); }
  double slope(double theta) const noexcept { return c1 + theta * (2.0 * c2 + theta * 3.0 * c3); }

  // Place of a minimum below zero inside (0, 1); 0 if there is none.
  double dip() const noexcept {
    const double discriminant = c2 * c2 - 3.0 * c1 * c3;
    if (!(discriminant > 0)) return 0;
    const double theta = -c1 / (c2 + std::sqrt(discriminant));
    return theta > 0 && theta < 1 && at(theta) < 0 ? theta : 0;
  }

  // A root in (0, end), given that it is below zero at end.
  double root_before(double end) const noexcept {
    double low = 0, high = end;
    for (int i = 0; i < 30; ++i) {
      const double middle = 0.5 * (low + high);
      (at(middle) < 0 ? high : low) = middle;
    }
    return high;
  }
};

}  // namespace farhand
