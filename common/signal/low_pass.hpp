// First-order low-pass, backward Euler:  y += a (u - y),  a = g dt / (1 + g dt).
//
// Backward Euler and not the "exact" pole exp(-g dt): its lag on a ramp is exactly 1/g, and therefore the inertia terms
// of the observers cancel (test Dob.SteadyAccelerationIsUnbiased). It is stable for every g dt; forward Euler
// oscillates from g dt = 1 and is unstable from 2.
#pragma once

#include "common/signal/cutoff.hpp"
#include "common/signal/joints.hpp"

namespace farhand {

template <int N>
class LowPass {
 public:
  // dt_s > 0; g >= 0.
  LowPass(Cutoff g, double dt_s) : a_(g.rad_s() * dt_s / (1.0 + g.rad_s() * dt_s)) {}

  const Joints<N>& step(const Joints<N>& u) noexcept {
    y_ += a_ * (u - y_);
    return y_;
  }
  void reset(const Joints<N>& y) noexcept { y_ = y; }
  const Joints<N>& value() const noexcept { return y_; }
  double smoothing() const noexcept { return a_; }

 private:
  double a_;
  Joints<N> y_ = Joints<N>::Zero();
};

}  // namespace farhand
