// Statistics over spans of time, for the parts of the metrics.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "common/judge/metrics.hpp"

namespace farhand {

inline constexpr double kTail_s = 2.0;  // steady values are taken over this much of the end of the contact window

struct Span {
  double from_s, until_s;
  bool has(double t) const { return t >= from_s && t < until_s; }
};

inline Span everything() { return {-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()}; }
inline Span tail_of(const Span& w) { return {std::max(w.from_s, w.until_s - kTail_s), w.until_s}; }
inline Span before_tail_of(const Span& w) {
  return {std::max(w.from_s, w.until_s - 2 * kTail_s), std::max(w.from_s, w.until_s - kTail_s)};
}

struct Statistics {
  std::size_t count = 0;
  double sum = 0, sum_squares = 0, least = kAbsent, most = kAbsent;
  void add(double y) {
    if (!std::isfinite(y)) return;
    ++count;
    sum += y;
    sum_squares += y * y;
    least = std::fmin(least, y);
    most = std::fmax(most, y);
  }
  double mean() const { return sum / static_cast<double>(count); }
  double rms() const { return std::sqrt(sum_squares / static_cast<double>(count)); }
  double peak() const { return std::max(std::abs(least), std::abs(most)); }
  double peak_to_peak() const { return most - least; }
};

inline Statistics over(const std::vector<double>& t_s, const std::vector<double>& y, const Span& span) {
  Statistics out;
  for (std::size_t k = 0; k < t_s.size(); ++k) {
    if (span.has(t_s[k])) out.add(y[k]);
  }
  return out;
}

// Nearest rank: a value that occurred, not more than share of all being larger than it.
inline double quantile(std::vector<double> y, double share) {
  if (y.empty()) return kAbsent;
  const auto rank = static_cast<std::size_t>(std::max(0.0, std::ceil(share * static_cast<double>(y.size())) - 1));
  std::nth_element(y.begin(), y.begin() + static_cast<std::ptrdiff_t>(rank), y.end());
  return y[rank];
}

inline void set_rms_and_peak(Metrics& out, std::string_view rms, std::string_view peak, const Statistics& s,
                             const std::string& because) {
  if (s.count == 0) {
    out.set_absent(rms, because);
    if (!peak.empty()) out.set_absent(peak, because);
    return;
  }
  out.set(rms, s.rms());
  if (!peak.empty()) out.set(peak, s.peak());
}

}  // namespace farhand
