// Arithmetic on times from outside. A peer or a recording may hold any 64-bit number as a stamp. A result that does not
// fit becomes the end of the range (292 years), because a signed overflow would be undefined. Results within the range
// are unchanged.
#pragma once

#include <cmath>
#include <limits>

#include "common/signal/joints.hpp"

namespace farhand {

inline constexpr Nanoseconds kFirstStamp = std::numeric_limits<Nanoseconds>::min();
inline constexpr Nanoseconds kLastStamp = std::numeric_limits<Nanoseconds>::max();

constexpr Nanoseconds stamp_sum(Nanoseconds a, Nanoseconds b) {
  Nanoseconds sum = 0;
  if (!__builtin_add_overflow(a, b, &sum)) return sum;
  return b < 0 ? kFirstStamp : kLastStamp;
}

constexpr Nanoseconds stamp_difference(Nanoseconds a, Nanoseconds b) {
  Nanoseconds difference = 0;
  if (!__builtin_sub_overflow(a, b, &difference)) return difference;
  return b > 0 ? kFirstStamp : kLastStamp;
}

// NaN becomes 0.
inline Nanoseconds stamp_from_seconds(double s) {
  constexpr double kRange_s = 9.2e9;  // inside of 2^63 ns
  if (std::isnan(s)) return 0;
  if (std::abs(s) < kRange_s) return from_seconds(s);
  return s < 0 ? kFirstStamp : kLastStamp;
}

}  // namespace farhand
