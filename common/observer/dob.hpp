// Disturbance observer: which torque acts on the axis that the nominal model does not explain?
//
//   tau_dis = LPF_g( tau + J_n g v ) - J_n g v,  tau = K_tn i          (Daud 2011, B.8)
//
// Positive tau_dis resists positive motion, so the caller adds it to its torque. The low-pass must be backward Euler:
// J_n g v is added before the filter and subtracted after it, and the two cancel in steady acceleration only if its
// ramp lag is exactly 1/g (test Dob.SteadyAccelerationIsUnbiased). tau must be the torque that was applied, after every
// limit. Fed with the torque that the law asks for, the estimate would wind up by the part that was cut (test
// BothDirections.DobSaturationLeavesNoRecoveryTime).
#pragma once

#include "common/signal/low_pass.hpp"

namespace farhand {

template <int N>
class Dob {
 public:
  Dob(double J_n, Cutoff g, double dt_s) : gain_(J_n * g.rad_s()), filter_(g, dt_s) {}

  // tau_applied: torque held since the last step, N m. v: velocity now, rad/s. Returns tau_dis, N m.
  // always_inline, because a call for so few operations would take a twentieth of a tick.
  [[gnu::always_inline]] const Joints<N>& step(const Joints<N>& tau_applied, const Joints<N>& v) noexcept {
    tau_dis_ = filter_.step(tau_applied + gain_ * v) - gain_ * v;
    return tau_dis_;
  }
  // Starts in the steady state in which tau_dis has acted for ever while the axis moved at v.
  void reset(const Joints<N>& tau_dis, const Joints<N>& v) noexcept {
    filter_.reset(tau_dis + gain_ * v);
    tau_dis_ = tau_dis;
  }
  const Joints<N>& value() const noexcept { return tau_dis_; }

 private:
  double gain_;
  LowPass<N> filter_;
  Joints<N> tau_dis_ = Joints<N>::Zero();
};

}  // namespace farhand
