// The patient's side with the hand orthosis: a series elastic actuator that touches a hand, a wall, both or nothing.
#pragma once

#include "common/plant/environment.hpp"
#include "common/plant/series_elastic.hpp"
#include "common/plant/world_step.hpp"

namespace farhand {

class SeriesElasticWorld {
 public:
  struct Params {
    SeriesElastic::Params actuator = {};
    Environment::Params environment = {};
    double start = 0;     // rad, of joint and motor: the spring is slack
    double step = 50e-6;  // s
  };
  using State = SeriesElastic::State;

  // Throws std::invalid_argument if the step is too long for what can be touched.
  explicit SeriesElasticWorld(const Params& params)
      : actuator_(params.actuator), environment_(params.environment), step_(params.step) {
    state_[SeriesElastic::kX] = state_[SeriesElastic::kXMotor] = params.start;
    check_world_step(
        step_, std::max(actuator_.rate(), fastest_rate(actuator_.J(), actuator_.stiffness() + environment_.stiffness(),
                                                       actuator_.damping() + environment_.damping())));
  }

  // The velocity command of the motor (rad/s at the joint) is held from t0_s to t1_s.
  void advance(double v_motor, double t0_s, double t1_s) noexcept {
    v_command_ = v_motor;
    rk4_advance(*this, state_, t0_s, t1_s, step_);
    t_ = t1_s;
  }

  double true_x() const noexcept { return state_[SeriesElastic::kX]; }
  double true_v() const noexcept { return state_[SeriesElastic::kV]; }
  // What hand and wall exert against the joint: pressing in + on them shows as positive. Tendon friction is not part of
  // it.
  double true_f() const noexcept { return environment_.reaction(t_, true_x(), true_v()); }
  double true_motor_x() const noexcept { return state_[SeriesElastic::kXMotor]; }
  double true_motor_v() const noexcept { return state_[SeriesElastic::kVMotor]; }
  double true_spring_torque() const noexcept { return actuator_.spring_torque(state_); }
  double true_tendon_torque() const noexcept { return state_[SeriesElastic::kTendon]; }
  double encoder() const noexcept { return actuator_.joint_encoder(state_); }
  double motor_encoder() const noexcept { return actuator_.motor_encoder(state_); }

  State derivative(double t, const State& s) const noexcept {
    return actuator_.derivative(s, v_command_, environment_.reaction(t, s[SeriesElastic::kX], s[SeriesElastic::kV]));
  }
  double stored_energy(double t, const State& s) const noexcept {
    return actuator_.stored_energy(s) + environment_.stored_energy(t, s[SeriesElastic::kX]);
  }
  PowerFlow power(double t, const State& s) const noexcept {
    PowerFlow flow = actuator_.power(s);
    flow.dissipated += environment_.dissipated_power(t, s[SeriesElastic::kX], s[SeriesElastic::kV]);
    return flow;
  }
  const State& state() const noexcept { return state_; }

 private:
  SeriesElastic actuator_;
  Environment environment_;
  double step_;
  State state_{};
  double v_command_ = 0, t_ = 0;
};

}  // namespace farhand
