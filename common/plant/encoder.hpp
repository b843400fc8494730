// Incremental encoder: the angle rounded to the nearest count. Rounding has no bias, and both directions read alike.
#pragma once

#include <cmath>
#include <numbers>

namespace farhand {

// counts_per_rev 0: ideal encoder.
inline double quantised(double angle, double counts_per_rev) noexcept {
  if (!(counts_per_rev > 0)) return angle;
  const double per_rad = counts_per_rev / (2.0 * std::numbers::pi);
  return std::floor(angle * per_rad + 0.5) / per_rad;
}

}  // namespace farhand
