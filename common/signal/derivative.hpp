// Band-limited derivative of an encoder position: v = LPF_g[(x - x_previous) / dt].
//
// It is computed in the telescoped form v = (y - y_previous) / dt with y = LPF_g[x]. This gives the same numbers with
// one state, and the first sample is no special case.
#pragma once

#include <cmath>

#include "common/signal/cutoff.hpp"
#include "common/signal/joints.hpp"

namespace farhand {

template <int N>
class Derivative {
 public:
  Derivative(Cutoff g_v, double dt_s) : dt_s_(dt_s), a_(g_v.rad_s() * dt_s / (1.0 + g_v.rad_s() * dt_s)) {}

  const Joints<N>& step(const Joints<N>& x) noexcept {
    v_ = (a_ / dt_s_) * (x - y_);
    y_ += a_ * (x - y_);
    return v_;
  }
  // At rest at x.
  void reset(const Joints<N>& x) noexcept {
    y_ = x;
    v_.setZero();
  }
  // Called instead of step() after missed ticks. It acts as that many steps on the straight line from the last position
  // to x: the gap does not become a spike, and the mean velocity over it is weighted with its duration.
  const Joints<N>& across(const Joints<N>& x, int ticks) noexcept {
    const Joints<N> mean = (x - last()) / (dt_s_ * ticks);
    v_ = mean + std::pow(1.0 - a_, ticks) * (v_ - mean);
    y_ = x - v_ * (dt_s_ / a_ - dt_s_);
    return v_;
  }

  const Joints<N>& value() const noexcept { return v_; }
  // The position of the last step or reset.
  Joints<N> last() const noexcept { return y_ + v_ * (dt_s_ / a_ - dt_s_); }

 private:
  double dt_s_;
  double a_;
  Joints<N> y_ = Joints<N>::Zero();
  Joints<N> v_ = Joints<N>::Zero();
};

}  // namespace farhand
