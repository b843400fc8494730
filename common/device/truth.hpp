// True values, which only a simulated world knows.
#pragma once

#include <limits>

namespace farhand {

struct Truth {
  double x = 0, v = 0, f = 0;  // rad, rad/s, N m in the sign of Motion::f
};

inline constexpr Truth kNoTruth{std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::quiet_NaN(),
                                std::numeric_limits<double>::quiet_NaN()};

}  // namespace farhand
