// Reaction torque observer: estimates the torque with which the person or the environment pushes back.
//
//   f = LPF_g( tau - (T_int + F_c + D v) + J_n g v ) - J_n g v          (Daud 2011, B.10)
//
// A disturbance observer with the known torques of the axis subtracted before the filter. Torques that the model does
// not contain (tendon friction, a wrong inertia) stay in f and look like the person.
#pragma once

#include "common/observer/axis_model.hpp"
#include "common/observer/dob.hpp"

namespace farhand {

template <int N>
class Rtob {
 public:
  Rtob(const AxisModel& model, Cutoff g, double dt_s) : model_(model), observer_(model.J_n, g, dt_s) {}

  // x, v: position and velocity now. tau_applied: torque held since the last step. Returns f, N m.
  [[gnu::always_inline]] const Joints<N>& step(const Joints<N>& tau_applied, const Joints<N>& x,
                                               const Joints<N>& v) noexcept {
    weight_ = model_.gravity_load<N>(x);
    return observer_.step(tau_applied - model_.known_load<N>(weight_, v), v);
  }
  void reset(const Joints<N>& f, const Joints<N>& v) noexcept { observer_.reset(f, v); }
  const Joints<N>& value() const noexcept { return observer_.value(); }
  // Gravity torque at the position of the last step, N m.
  const Joints<N>& gravity_load() const noexcept { return weight_; }

 private:
  AxisModel model_;
  Dob<N> observer_;
  Joints<N> weight_ = Joints<N>::Zero();
};

}  // namespace farhand
