// The patient's side with the orthosis: the loops of its MCU in floating point, so that encoders may be ideal and any
// scalar type can be used, and the references of the station without a serial line between them. Faults, watchdog and
// the gates on frames are left out; limits of torque and motor speed are included.
//
//   v_motor = v_joint + gain (tau_ref - tau_spring),   DOB and RTOB on the spring torque (slave/mcu/orthosis_mcu.cpp)
#pragma once

#include <algorithm>

#include "netem/lab/bare_law.hpp"
#include "netem/lab/plain_step.hpp"
#include "slave/mcu/mcu_params.hpp"

namespace farhand {

// At the rate of the MCU.
template <class T>
class OrthosisLaw {
 public:
  explicit OrthosisLaw(const mcu::McuSettings& s)
      : s_(s),
        dt_(1 / static_cast<T>(s.loop_hz)),
        a_(s.g * dt_ / (1 + s.g * dt_)),
        a_v_(s.g_v * dt_ / (1 + s.g_v * dt_)),
        inertia_(static_cast<T>(s.J_n) * s.g),
        allowed_step_(s.torque_limit * dt_ / s.ramp_s) {}

  void start(T x, T spring_torque) noexcept {
    x_filtered_ = x;
    reference_ = {x, T{}, -spring_torque};
    dob_ = rtob_ = spring_torque;
  }

  // Once per frame.
  void follow(const Sent<T>& reference) noexcept {
    reference_ = reference;
    fresh_ = true;
  }

  // Once per loop: angles of joint and motor in, velocity of the motor out.
  T step(T x, T x_motor) noexcept {
    const T spring = s_.spring * (x_motor - x);
    v_ = a_v_ / dt_ * (x - x_filtered_);
    x_filtered_ += a_v_ * (x - x_filtered_);
    const T momentum = inertia_ * v_;
    dob_ += a_ * (spring + momentum - dob_);
    rtob_ += a_ * (spring - s_.viscous * v_ + momentum - rtob_);
    f_ = rtob_ - momentum;
    if (!fresh_) reference_.x = clip(reference_.x + dt_ * reference_.v, s_.range_min, s_.range_max);
    fresh_ = false;
    allowed_ = std::min<T>(allowed_ + allowed_step_, s_.torque_limit);
    const T a_ref = s_.K_p * (reference_.x - x) + s_.K_d * (reference_.v - v_) - s_.K_f * (reference_.f + f_);
    const T wish = clip(s_.J_n * a_ref + dob_ - momentum, -allowed_, allowed_);
    torque_ += clip(wish - torque_, -s_.torque_rate_limit * dt_, s_.torque_rate_limit * dt_);
    return clip(v_ + s_.spring_gain * (torque_ - spring), -s_.motor_speed_limit, s_.motor_speed_limit);
  }

  T f() const noexcept { return f_; }

 private:
  static T clip(T u, T low, T high) noexcept { return plain_clip<T>(u, low, high); }

  mcu::McuSettings s_;
  T dt_, a_, a_v_, inertia_, allowed_step_;
  Sent<T> reference_;
  bool fresh_ = false;
  T v_{}, f_{}, x_filtered_{}, dob_{}, rtob_{}, torque_{}, allowed_{};
};

}  // namespace farhand
