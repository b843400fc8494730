#include "common/identify/free_motion.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace farhand {

FreeMotion::FreeMotion(const Params& params) noexcept
    : params_(params),
      length_(8 * std::clamp(static_cast<int>(params.window_s / params.dt_s / 8.0 + 0.5), 1, kLongest / 8)),
      hop_(length_ / 8) {
  double sum = 0.0, squares = 0.0;
  for (int i = 1; i < length_; ++i) {
    const double root = std::sin(std::numbers::pi * i / length_);
    weight_[i] = root * root;
    sum += weight_[i];
  }
  for (int i = 1; i < length_; ++i) weight_[i] /= sum;
  for (int i = 0; i <= length_; ++i) {
    const double left = i > 0 ? weight_[i - 1] : 0.0, right = i < length_ ? weight_[i + 1] : 0.0;
    const double second = left - 2.0 * weight_[i] + right;
    squares += second * second;
  }
  // Rounding to a count: variance 1/12.
  encoder_noise_ = params.resolution * std::sqrt(squares / 12.0) / (params.dt_s * params.dt_s);
}

void FreeMotion::add(double x, double torque) noexcept {
  x_[filled_] = x;
  torque_[filled_] = torque;
  if (++filled_ <= length_) return;
  const int way = direction();
  if (way != 0) take(way);
  std::copy(x_.begin() + hop_, x_.begin() + filled_, x_.begin());
  std::copy(torque_.begin() + hop_, torque_.begin() + filled_, torque_.begin());
  filled_ -= hop_;
}

int FreeMotion::direction() const noexcept {
  const int way = x_[length_] > x_[0] ? 1 : -1;
  const double least = params_.slowest * params_.dt_s * hop_;
  for (int i = 0; i < length_; i += hop_) {
    if (way * (x_[i + hop_] - x_[i]) < least) return 0;
  }
  return way;
}

void FreeMotion::take(int direction) noexcept {
  const double dt = params_.dt_s;
  Rows::Row row = Rows::Row::Zero();
  double torque = 0.0;
  for (int i = 1; i < length_; ++i) {
    const double w = weight_[i];
    // Under a held torque the second difference belongs to the mean of the torques before and after.
    torque += w * (params_.torque == Torque::kHeld ? 0.5 * (torque_[i - 1] + torque_[i]) : torque_[i]);
    row[0] += w * (x_[i + 1] - 2.0 * x_[i] + x_[i - 1]);
    row[1] += w * (x_[i + 1] - x_[i - 1]);
    row[3] -= w * std::sin(x_[i]);
    row[4] -= w * std::cos(x_[i]);
  }
  row[0] /= dt * dt;
  row[1] /= 2.0 * dt;
  row[2] = direction;
  if (last_direction_ != 0 && direction != last_direction_) rows_.close();
  last_direction_ = direction;
  rows_.add(row, torque);
}

FreeMotionEstimate FreeMotion::estimate() const noexcept {
  const Rows::Solution s = rows_.solve();
  const auto at = [&](int i) { return Estimate{s.value[i], s.half_width[i]}; };
  FreeMotionEstimate e;
  e.determined = s.determined;
  e.J = at(0), e.viscous = at(1), e.coulomb = at(2), e.P = at(3), e.Q = at(4);
  e.residual = s.residual;
  e.expected = std::abs(s.value[0]) * encoder_noise_;
  e.torque = s.spread;
  e.rows = s.rows;
  e.sweeps = s.blocks;
  return e;
}

}  // namespace farhand
