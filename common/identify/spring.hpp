// Estimates the constant of a spring: slope of its torque over its deflection while it is slowly loaded and released,
// with the joint held or not. Zero errors of both sensors have no effect. A branch in which the load only grows, or
// only falls, is a block.
//
//   torque = k deflection + c
//
// A joint that its stop or a hand holds within one count of its encoder seems not to move at all. Its small motion
// becomes an error of k, of up to a count over the deflection (0.3 % at 0.1 rad), which no interval shows.
//
// An error in the scale of the torque sensor (or of the known load) enters k completely: they cannot be separated.
#pragma once

#include "common/identify/free_motion.hpp"

namespace farhand {

struct SpringEstimate {
  bool determined = false;  // false: the load was too small
  Estimate k, offset;       // N m/rad, N m
  double residual = 0.0;    // N m, RMS over the rows
  double expected = 0.0;    // N m, the part of it that the resolution of both encoders explains
  double torque = 0.0;      // N m, half of the range of the torque
  int rows = 0, branches = 0;
};

class Spring {
 public:
  // resolution: rad, a count of the deflection, the coarser of both encoders.
  explicit Spring(double resolution) noexcept : resolution_(resolution) {}

  void add(double deflection, double torque) noexcept;

  SpringEstimate estimate() const noexcept;

 private:
  static constexpr int kMean = 32;       // samples to a row
  static constexpr double kTurn = 0.02;  // N m; the load counts as reversed when it went back by this
  static constexpr double kLeast = 0.1;  // N m, least range of the torque

  double resolution_;
  double deflection_sum_ = 0.0, torque_sum_ = 0.0;
  double peak_ = 0.0, low_ = 0.0, high_ = 0.0;
  int count_ = 0, way_ = 0;
  bool any_ = false;
  BlockedLeastSquares<2> rows_;
};

}  // namespace farhand
