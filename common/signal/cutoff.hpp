// A cut-off frequency that knows its unit. In public low-pass filters a bare number has five different meanings.
#pragma once

#include <numbers>

namespace farhand {

class Cutoff {
 public:
  static constexpr Cutoff rad_s(double value) { return Cutoff(value); }
  static constexpr Cutoff hz(double value) { return Cutoff(2.0 * std::numbers::pi * value); }

  constexpr double rad_s() const { return rad_s_; }
  constexpr double hz() const { return rad_s_ / (2.0 * std::numbers::pi); }

 private:
  explicit constexpr Cutoff(double value) : rad_s_(value) {}
  double rad_s_;
};

}  // namespace farhand
