// Numbers as text for readers, independent of the locale of the process.
#pragma once

#include <string>

namespace farhand {

// 12.3, 0.00123, 1.23e-07; "-" if not finite.
std::string three_digits(double y);

// The parts of three_digits. Beyond these bounds an exponent reads better.
inline constexpr double kLeastWithoutExponent = 1e-3, kMostWithoutExponent = 1e6;
std::string with_decimals(double y, int decimals);  // 12.30; never -0.00
std::string with_exponent(double y);                // 1.23e-07

}  // namespace farhand
