// Estimates inertia, friction and weight of an axis that moves freely under a known torque.
//
//   tau = J a + D v + F_c sign v - P sin x - Q cos x,   P = G cos angle, Q = G sin angle    (observer/axis_model.hpp)
//
// Motion at constant velocity determines the friction, accelerated motion the inertia (Daud 2011, B.2); both together
// are one linear regression. The angle is not differentiated: each window of the motion is weighted with sin^2, and the
// two derivatives are moved to the weight by partial integration, so that quantisation enters each row once, bounded.
// Only windows in which the axis slides in one direction throughout become rows. A sweep is a block.
//
// Some effects cannot be separated: J, D, F_c, P and Q all scale with the torque constant; weight looks like a spring
// of -P and a constant torque of -Q, and a limp hand like more inertia and friction.
#pragma once

#include <array>

#include "common/identify/blocked_least_squares.hpp"

namespace farhand {

struct Estimate {
  double value = 0.0;
  double half_width = 0.0;  // the interval of 95 % is value +- this
};

struct FreeMotionEstimate {
  bool determined = false;  // false: the motion was too small, or too uniform
  Estimate J, viscous, coulomb, P, Q;
  double residual = 0.0;  // N m, RMS over the rows
  double expected = 0.0;  // N m, the part of it that the encoder's resolution explains
  double torque = 0.0;    // N m, RMS over the rows
  int rows = 0, sweeps = 0;
};

class FreeMotion {
 public:
  enum class Torque {
    kHeld,    // from a sample to the next, as a control loop applies it
    kSampled  // at the sample, as a sensor reads it
  };
  struct Params {
    double dt_s = 1e-3;
    double resolution = 3.14159e-4;  // rad, a count of the encoder
    Torque torque = Torque::kHeld;
    double window_s = 0.128;
    double slowest = 0.1;  // rad/s; slower, friction may not be that of sliding
  };

  explicit FreeMotion(const Params& params) noexcept;

  // One sample per period.
  void add(double x, double torque) noexcept;
  // The next sample does not follow the last one.
  void interrupt() noexcept { filled_ = 0; }

  // Forgets all samples.
  void restart() noexcept {
    rows_ = {};
    filled_ = last_direction_ = 0;
  }

  FreeMotionEstimate estimate() const noexcept;

 private:
  static constexpr int kLongest = 640;  // samples
  using Rows = BlockedLeastSquares<5>;

  int direction() const noexcept;  // +-1 where the whole window slides so, else 0
  void take(int direction) noexcept;

  Params params_;
  int length_, hop_;  // samples
  std::array<double, kLongest + 1> weight_{}, x_{}, torque_{};
  double encoder_noise_ = 0.0;  // rad/s2 of a row, RMS
  int filled_ = 0;
  int last_direction_ = 0;
  Rows rows_;
};

}  // namespace farhand
