// Friction of an axis that is led slowly to and fro with nothing in it: half the width of the loop of its reaction over
// the angle. Torques that depend on the angle alone (a weight, a spring, a hand) are equal in both directions. They do
// not enter the width; they are the slope of the loop's middle line.
//
// The angle is divided into bins. In each bin and round the difference of the two means is one value of the friction;
// the median of all values is the result, so that a count of the encoder or a rough spot in one bin does not move it.
#pragma once

#include <array>
#include <cstddef>

namespace farhand {

struct LoopFriction {
  double F_c = 0.0;     // N m, median of half the loop's width; never negative
  double spread = 0.0;  // N m, standard deviation of the values over angle and rounds, from their median deviation
  double slope = 0.0;   // N m/rad, of the loop's middle line
  int values = 0;       // bins in which both directions were seen; 0: nothing is known
};

class LoopFrictionFit {
 public:
  static constexpr std::size_t kBins = 16, kRounds = 2;

  // low, high: angles between which the motion is evaluated, rad.
  LoopFrictionFit(double low, double high) noexcept : low_(low), width_(high - low) {}

  void restart() noexcept { sums_ = {}; }
  // round: 0 or 1; direction: sign of the motion; f: reaction, N m.
  void add(std::size_t round, int direction, double x, double f) noexcept;
  // Of the first rounds.
  LoopFriction result(std::size_t rounds) const noexcept;

 private:
  struct Sum {
    double f = 0.0;
    int count = 0;
  };
  double low_, width_;
  std::array<std::array<std::array<Sum, 2>, kBins>, kRounds> sums_{};
};

}  // namespace farhand
