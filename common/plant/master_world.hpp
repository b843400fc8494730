// The therapist's side: a motor axis in the therapist's hand.
//
//   (J + J_h) a = tau - resistance(x, v) + K_h (x_int - x) + B_h (v_int - v)
#pragma once

#include <array>

#include "common/plant/motor_axis.hpp"
#include "common/plant/therapist.hpp"
#include "common/plant/world_step.hpp"

namespace farhand {

class MasterWorld {
 public:
  struct Params {
    MotorAxis::Params motor = {};
    Therapist::Params therapist = {};
    double start = 0;     // rad, of the device and of the intended motion
    double step = 50e-6;  // s
  };
  using State = std::array<double, 2>;  // x, v

  // Throws std::invalid_argument if the step is too long for what can be touched.
  explicit MasterWorld(const Params& params)
      : axis_(params.motor), therapist_(params.therapist, params.start), step_(params.step), state_{params.start, 0.0} {
    check_world_step(step_, fastest_rate(axis_.J() + therapist_.J_h(), axis_.stiffness() + therapist_.K_h(),
                                         axis_.damping() + therapist_.B_h()));
  }

  // The motor torque is held from t0_s to t1_s.
  void advance(double torque, double t0_s, double t1_s) noexcept {
    torque_ = torque;
    rk4_advance(*this, state_, t0_s, t1_s, step_);
    t_ = t1_s;
  }

  double true_x() const noexcept { return state_[0]; }
  double true_v() const noexcept { return state_[1]; }
  // Minus the therapist's torque on the device, under the motor torque of the last advance: pushing in + shows as
  // negative.
  double true_f() const noexcept {
    return therapist_.J_h() * derivative(t_, state_)[1] - therapist_.pull(t_, state_[0], state_[1]);
  }
  double encoder() const noexcept { return axis_.encoder(state_[0]); }
  double intended_x() const noexcept { return therapist_.motion().at(t_).x; }

  State derivative(double t, const State& s) const noexcept {
    const double torque = torque_ - axis_.resistance(s[0], s[1]) + therapist_.pull(t, s[0], s[1]);
    return {s[1], torque / (axis_.J() + therapist_.J_h())};
  }
  double stored_energy(double t, const State& s) const noexcept {
    return axis_.stored_energy(s[0], s[1]) + therapist_.stored_energy(t, s[0], s[1]);
  }
  PowerFlow power(double t, const State& s) const noexcept {
    const PowerFlow arm = therapist_.power(t, s[0], s[1]);
    return {torque_ * s[1] + arm.supplied, axis_.dissipated_power(s[0], s[1]) + arm.dissipated};
  }
  const State& state() const noexcept { return state_; }

 private:
  MotorAxis axis_;
  Therapist therapist_;
  double step_;
  State state_;
  double torque_ = 0, t_ = 0;
};

}  // namespace farhand
