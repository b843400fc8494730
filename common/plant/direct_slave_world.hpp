// The patient's side with an ideal device: a motor axis that touches a hand, a wall, both or nothing.
#pragma once

#include <array>

#include "common/plant/environment.hpp"
#include "common/plant/motor_axis.hpp"
#include "common/plant/world_step.hpp"

namespace farhand {

class DirectSlaveWorld {
 public:
  struct Params {
    MotorAxis::Params motor = {};
    Environment::Params environment = {};
    double start = 0;     // rad
    double step = 50e-6;  // s
  };
  using State = std::array<double, 2>;  // x, v

  // Throws std::invalid_argument if the step is too long for what can be touched.
  explicit DirectSlaveWorld(const Params& params)
      : axis_(params.motor), environment_(params.environment), step_(params.step), state_{params.start, 0.0} {
    check_world_step(step_, fastest_rate(axis_.J(), axis_.stiffness() + environment_.stiffness(),
                                         axis_.damping() + environment_.damping()));
  }

  // The motor torque is held from t0_s to t1_s.
  void advance(double torque, double t0_s, double t1_s) noexcept {
    torque_ = torque;
    rk4_advance(*this, state_, t0_s, t1_s, step_);
    t_ = t1_s;
  }

  double true_x() const noexcept { return state_[0]; }
  double true_v() const noexcept { return state_[1]; }
  // What hand and wall exert against the device: pressing in + on them shows as positive.
  double true_f() const noexcept { return environment_.reaction(t_, state_[0], state_[1]); }
  double encoder() const noexcept { return axis_.encoder(state_[0]); }

  State derivative(double t, const State& s) const noexcept {
    return {s[1], (torque_ - axis_.resistance(s[0], s[1]) - environment_.reaction(t, s[0], s[1])) / axis_.J()};
  }
  double stored_energy(double t, const State& s) const noexcept {
    return axis_.stored_energy(s[0], s[1]) + environment_.stored_energy(t, s[0]);
  }
  PowerFlow power(double t, const State& s) const noexcept {
    return {torque_ * s[1], axis_.dissipated_power(s[0], s[1]) + environment_.dissipated_power(t, s[0], s[1])};
  }
  const State& state() const noexcept { return state_; }

 private:
  MotorAxis axis_;
  Environment environment_;
  double step_;
  State state_;
  double torque_ = 0, t_ = 0;
};

}  // namespace farhand
