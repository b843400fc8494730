#include "common/judge/digits.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace farhand {
namespace {

constexpr int kDigits = 3;

}  // namespace

std::string with_decimals(double y, int decimals) {
  char buffer[400];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, y, std::chars_format::fixed, decimals);
  std::string out(buffer, end.ptr);
  return out.find_first_not_of("-0.") == std::string::npos && out[0] == '-' ? out.substr(1) : out;  // no -0.00
}

std::string with_exponent(double y) {
  char buffer[64];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, y, std::chars_format::scientific, kDigits - 1);
  return {buffer, end.ptr};
}

std::string three_digits(double y) {
  if (!std::isfinite(y)) return "-";
  if (y == 0) return "0";
  // The exponent after rounding: 9.996 is 10.0 and not 10.00.
  const std::string rounded = with_exponent(y);
  const int exponent = std::stoi(rounded.substr(rounded.find('e') + 1));
  if (std::abs(y) < kLeastWithoutExponent || std::abs(y) >= kMostWithoutExponent) return rounded;
  return with_decimals(y, std::max(0, kDigits - 1 - exponent));
}

}  // namespace farhand
