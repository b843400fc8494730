#include "common/show/format.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/config/json.hpp"
#include "common/judge/digits.hpp"

namespace farhand {
namespace {

// 1.00e-08 as 1e-8: what is written beside an axis need not show how exact it is.
std::string bare(const std::string& scientific) {
  const std::size_t e = scientific.find('e'), digit = scientific.find_first_of("123456789", e);
  std::string mantissa = scientific.substr(0, e);
  mantissa.erase(mantissa.find_last_not_of("0.") + 1);
  return mantissa + (scientific[e + 1] == '-' ? "e-" : "e") +
         (digit == std::string::npos ? "0" : scientific.substr(digit));
}

}  // namespace

std::vector<double> ticks(double from, double until, int wanted, bool log) {
  std::vector<double> out;
  if (!(until > from) || !std::isfinite(from) || !std::isfinite(until) || (log && !(from > 0))) return out;
  if (log) {
    const double decades = std::log10(until / from);
    for (double decade = std::floor(std::log10(from)); decade <= std::log10(until); ++decade) {
      for (const double digit : {1.0, 2.0, 5.0}) {
        const double tick = digit * std::pow(10, decade);
        const bool wanted_digit =
            digit == 1.0 ? std::fmod(std::abs(decade), std::max(1.0, std::ceil(decades / 10))) == 0 : decades <= 3;
        if (wanted_digit && tick >= from * (1 - 1e-9) && tick <= until * (1 + 1e-9)) out.push_back(tick);
      }
    }
    return out;
  }
  const double raw = (until - from) / std::max(1, wanted), power = std::pow(10, std::floor(std::log10(raw)));
  double step = 10 * power;
  for (const double digit : {5.0, 2.0, 1.0}) {
    if (digit * power >= raw * (1 - 1e-9)) step = digit * power;
  }
  const double first = std::ceil(from / step - 1e-9);
  for (int k = 0; (first + k) * step <= until + 1e-9 * step && k < 1000; ++k) out.push_back((first + k) * step);
  return out;
}

std::string tick_label(double y, double step) {
  if (!std::isfinite(y) || !(step > 0)) return "-";
  if (std::max(std::abs(y), step) >= kMostWithoutExponent || step < 1e-6) return y == 0 ? "0" : bare(with_exponent(y));
  return with_decimals(y, std::max(0, static_cast<int>(-std::floor(std::log10(step) + 1e-9))));
}

std::string decade_label(double y) {
  return y > 0 && y < kLeastWithoutExponent ? bare(with_exponent(y)) : tick_label(y, y);
}

std::string quantity(double y, std::string_view unit) {
  if (!std::isfinite(y)) return "-";
  if (unit == "rad") return three_digits(1e3 * y) + " mrad (" + three_digits(y * 180 / std::numbers::pi) + "\u00b0)";
  if (unit == "N m" && y != 0 && std::abs(y) < 0.1) return three_digits(1e3 * y) + " mN m";
  if (unit == "J" && y != 0 && std::abs(y) < 0.1) return three_digits(1e3 * y) + " mJ";
  if (unit.empty() || unit == "1") return three_digits(y);
  return three_digits(y) + " " + std::string(unit);
}

std::string escaped(std::string_view text) {
  const std::string clean = valid_utf8(text);
  std::string out;
  for (const char c : clean) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        if (static_cast<unsigned char>(c) >= 0x20 || c == '\n' || c == '\t')
          out += c;
        else
          out += "\ufffd";
    }
  }
  return out;
}

}  // namespace farhand
