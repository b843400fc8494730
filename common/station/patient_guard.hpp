// Authority of the patient's side: what a hand in the device may be given, decided in the box and by nothing that comes
// over the network. One per follower; the therapist's station has the watch alone (common/station/axis_watch.hpp).
//
//   limit                  reaction                                              where
//   torque, its rate,      clip: the last gate                                   common/station/limits.hpp
//   references
//   speed, power, way to   less acceleration, by torque and speed now            common/station/person_bound.hpp, or
//   the end of the range                                                         the MCU
//   power, mean of 13 ms   lower gain: the network's share falls at once,        common/station/patient_limits.hpp
//                          comes back slowly
//   energy in a minute     hold until below 0.9 of it, then let go               "
//   warmth of the motor    hold until below 0.9 of it, then let go               "
//   session time           hold, then let go, until the patient's side resets    "
//   implausible reading    fault                                                 common/observer/plausibility.hpp
//   what an MCU finds      fault                                                 common/device/mcu_axis.hpp
//   shaking                lower gain, hold until it is calm, fault              common/observer/oscillation.hpp
//
// Each limit warns at 0.9. Gain g turns the motion to follow into one that asks for less (yielding() below):
//
//   a_ref = g (K_p (x_r - x) + K_d v_r - K_f f_r) - K_d v - K_f f
//
// What comes from the network is scaled; damping and giving way to the hand stay whole. At g = 0 that is a damper that
// yields. Why it is stable: for any fixed g the loop over the network has g of its gain, and the spring to the peer is
// softer under the same damping. A falling g takes energy out of that spring, a rising one puts in K_p J_n e^2/2 at
// most over soft_start_s; so it may fall at once and rises slowly. The same ramp is the soft start after each
// engagement.
#pragma once

#include <algorithm>

#include "common/station/axis_watch.hpp"
#include "common/station/patient_limits.hpp"

namespace farhand {

template <int N>
class PatientGuard {
 public:
  PatientGuard(const GuardParams& params, const DriveParams& drive) noexcept;

  GuardVerdict step(const GuardInputs<N>& in) noexcept;

  // What the drive may follow under gain g. Towards the end of the range the peer's velocity, and its force beyond the
  // hand's, fade out: a position reference that ends there beside a force that does not would push the hand on.
  // Over 1.5 degrees, because this is a spring of K_f |f_r + f| / kFade, 50 rad/s at 0.5 N m: one degree of all the
  // torque swings on behind an MCU, 8 ms late.
  Motion<N> allow(const Motion<N>& local, const Motion<N>& target, double g) const noexcept {
    Motion<N> to = yielding(local, target, g);
    for (int i = 0; i < N; ++i) {
      const double up = (gate_.range_max - local.x[i]) / kFade, down = (local.x[i] - gate_.range_min) / kFade;
      if (up >= 1.0 && down >= 1.0) continue;
      const double push = -(to.f[i] + local.f[i]);
      to.f[i] = -local.f[i] - push * std::clamp(push > 0.0 ? up : down, 0.0, 1.0);
      to.v[i] *= std::clamp(to.v[i] > 0.0 ? up : down, 0.0, 1.0);
    }
    return to;
  }

  // An act of the patient's side: another session begins. Warmth and energy are not forgotten.
  void reset() noexcept { dose_.begin_session(); }

  const DoseLimits& dose() const noexcept { return dose_; }

 private:
  static constexpr double kFade = 0.0262;  // rad
  GateParams gate_;
  double K_tn_, dt_s_;
  DoseLimits dose_;
  AxisWatch<N> watch_;
  Joints<N> v_reference_ = Joints<N>::Zero();
};

extern template class PatientGuard<1>;

}  // namespace farhand
