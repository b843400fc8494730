#include "common/identify/spring.hpp"

#include <algorithm>
#include <cmath>

namespace farhand {

void Spring::add(double deflection, double torque) noexcept {
  deflection_sum_ += deflection;
  torque_sum_ += torque;
  if (++count_ < kMean) return;
  const double mean = torque_sum_ / kMean;
  BlockedLeastSquares<2>::Row row;
  row << deflection_sum_ / kMean, 1.0;
  deflection_sum_ = torque_sum_ = 0.0;
  count_ = 0;
  if (!any_) peak_ = low_ = high_ = mean;
  any_ = true;
  low_ = std::min(low_, mean);
  high_ = std::max(high_, mean);
  if (way_ == 0 && std::abs(mean - peak_) > kTurn) way_ = mean > peak_ ? 1 : -1;
  if (way_ * (mean - peak_) > 0) peak_ = mean;
  if (way_ * (peak_ - mean) > kTurn) {
    rows_.close();
    way_ = -way_;
    peak_ = mean;
  }
  rows_.add(row, mean);
}

SpringEstimate Spring::estimate() const noexcept {
  const BlockedLeastSquares<2>::Solution s = rows_.solve();
  SpringEstimate e;
  e.torque = 0.5 * (high_ - low_);
  e.determined = s.determined && e.torque > 0.5 * kLeast;
  e.k = {s.value[0], s.half_width[0]};
  e.offset = {s.value[1], s.half_width[1]};
  e.residual = s.residual;
  e.expected = std::abs(s.value[0]) * resolution_ / std::sqrt(6.0 * kMean);  // of two encoders, each a count / sqrt 12
  e.rows = s.rows;
  e.branches = s.blocks;
  return e;
}

}  // namespace farhand
