// Delays of one direction in constant memory: exact count, mean, deviation and extremes; quantiles as of the histogram.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/runtime/duration_histogram.hpp"

namespace farhand {

class DelayStatistics {
 public:
  void add(Nanoseconds delay) noexcept {
    histogram_.add(delay);
    min_ = std::min(min_, delay);
    // Welford 1962: a sum of squares would lose the deviation of a long session to rounding.
    const double x = to_seconds(delay), before = x - mean_;
    mean_ += before / static_cast<double>(histogram_.count());
    squares_ += before * (x - mean_);
  }

  std::uint64_t count() const noexcept { return histogram_.count(); }
  double mean_s() const noexcept { return mean_; }
  double deviation_s() const noexcept {
    return count() > 1 ? std::sqrt(squares_ / static_cast<double>(count() - 1)) : 0;
  }
  double min_s() const noexcept { return count() > 0 ? to_seconds(min_) : 0; }
  double max_s() const noexcept { return to_seconds(histogram_.max()); }
  double quantile_s(double q) const noexcept { return to_seconds(histogram_.quantile(q)); }

 private:
  DurationHistogram histogram_;
  Nanoseconds min_ = std::numeric_limits<Nanoseconds>::max();
  double mean_ = 0, squares_ = 0;
};

}  // namespace farhand
