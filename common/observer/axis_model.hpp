// The controller's model of one axis: nominal inertia and the torques that it knows without measuring them.
#pragma once

#include "common/signal/joints.hpp"

namespace farhand {

struct AxisModel {
  double J_n = 4e-3;  // nominal inertia, kg m2. Slightly low is harmless, high is not: stable for J_n/J up to about 1.3
  double K_tn = 0.15;          // nominal torque constant, N m/A
  double viscous = 0.002;      // N m s/rad
  double coulomb = 0.0;        // N m
  double gravity = 0.0;        // weight times lever, N m
  double gravity_angle = 0.0;  // rad, angle of the centre of mass from the upright at x = 0

  // Gravity torque with the sign of a load: positive resists positive motion (J a = tau - load). An upright mass falls
  // away from x = 0; its load is therefore negative for x > 0.
  template <int N>
  Joints<N> gravity_load(const Joints<N>& x) const noexcept {
    if (gravity == 0.0) return Joints<N>::Zero();  // no sine is computed for an axis without weight
    return -gravity * (x + gravity_angle).sin();
  }

  // T_int + F_c + D w of (Daud 2011, B.10), with the sign of a load. `weight` is the gravity torque; it is an argument
  // because the law needs it too and its sine takes a fifth of a tick. Coulomb friction is smoothed over +-kStandstill:
  // the bare sign of a quantised velocity would feed the encoder's last count back as torque.
  template <int N>
  Joints<N> known_load(const Joints<N>& weight, const Joints<N>& v) const noexcept {
    if (coulomb == 0.0) return weight + viscous * v;
    return weight + viscous * v + coulomb * (v / kStandstill).tanh();
  }

  static constexpr double kStandstill = 0.02;  // rad/s
};

}  // namespace farhand
