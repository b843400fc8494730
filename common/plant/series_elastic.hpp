// The hand orthosis: a motor that is commanded a velocity, a spring, and the joint with the hand's inertia behind the
// tendons (Daud 2011, 5.2.2: velocity-sourced series elastic actuator; all angles are seen at the joint).
//
//   v_motor' = 2 pi bandwidth (clamp(u) - v_motor)                 the drive's own loop, first order
//   J v' = spring (x_motor - x) - viscous v - tendon - stops - f
//
// Friction acts after the spring: the spring, which is the torque sensor, does not see it.
#pragma once

#include <algorithm>
#include <array>
#include <numbers>

#include "common/plant/encoder.hpp"
#include "common/plant/stops.hpp"
#include "common/plant/tendon_friction.hpp"

namespace farhand {

class SeriesElastic {
 public:
  struct Params {
    double spring = 10;
    double J = 0.004;  // joint with hand
    double viscous = 0.002;
    TendonFriction::Params tendon = {};
    double motor_bandwidth_hz = 30;
    double motor_speed_limit = 4;
    double joint_counts_per_rev = 20000;  // 0: ideal
    double motor_counts_per_rev = 20000;  // seen at the joint; 0: ideal
    double stop_min = -0.5236;
    double stop_max = 0.5236;
  };

  enum Index : std::size_t { kX, kV, kXMotor, kVMotor, kTendon, kStates };
  using State = std::array<double, kStates>;

  explicit SeriesElastic(const Params& params)
      : p_(params),
        drive_rate_(2.0 * std::numbers::pi * params.motor_bandwidth_hz),
        tendon_(params.tendon),
        stops_(params.stop_min, params.stop_max, params.J) {}

  // v_command: rad/s of the motor; f: what the person resists with.
  State derivative(const State& s, double v_command, double f) const noexcept {
    const double v_allowed = std::clamp(v_command, -p_.motor_speed_limit, p_.motor_speed_limit);
    const double torque = spring_torque(s) - p_.viscous * s[kV] - s[kTendon] - stops_.reaction(s[kX], s[kV]) - f;
    return {s[kV], torque / p_.J, s[kVMotor], drive_rate_ * (v_allowed - s[kVMotor]),
            tendon_.derivative(s[kTendon], s[kV])};
  }
  double spring_torque(const State& s) const noexcept { return p_.spring * (s[kXMotor] - s[kX]); }
  double joint_encoder(const State& s) const noexcept { return quantised(s[kX], p_.joint_counts_per_rev); }
  double motor_encoder(const State& s) const noexcept { return quantised(s[kXMotor], p_.motor_counts_per_rev); }

  // The motor is a source of velocity: its own inertia is not part of the balance.
  double stored_energy(const State& s) const noexcept {
    const double stretch = s[kXMotor] - s[kX];
    return 0.5 * p_.J * s[kV] * s[kV] + 0.5 * p_.spring * stretch * stretch + tendon_.stored_energy(s[kTendon]) +
           stops_.stored_energy(s[kX]);
  }
  PowerFlow power(const State& s) const noexcept {
    return {spring_torque(s) * s[kVMotor], p_.viscous * s[kV] * s[kV] + tendon_.dissipated_power(s[kTendon], s[kV]) +
                                               stops_.dissipated_power(s[kX], s[kV])};
  }
  double J() const noexcept { return p_.J; }
  double stiffness() const noexcept { return p_.spring + kStopStiffness + tendon_.stiffness(); }
  double damping() const noexcept { return p_.viscous + stops_.damping(); }
  // Of the drive and, at twice the speed of the motor (the spring can throw the joint ahead), of the tendons; 1/s.
  double rate() const noexcept { return std::max(drive_rate_, tendon_.rate(2.0 * p_.motor_speed_limit)); }

 private:
  Params p_;
  double drive_rate_;
  TendonFriction tendon_;
  Stops stops_;
};

}  // namespace farhand
