// Authority of the patient's side: the limits of torque, speed, power and energy at the hand. They are decided in the
// box, and nothing that comes over the network changes them. Each follower has a guard; the therapist's station has
// only its watch (common/station/axis_watch.hpp).
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
// Each limit warns at 0.9. The gain g reduces the effect of the motion to follow (yielding() below):
//
//   a_ref = g (K_p (x_r - x) + K_d v_r - K_f f_r) - K_d v - K_f f
//
// Only the terms that come from the network are scaled; damping and yielding to the hand stay complete. At g = 0 the
// axis is a damper that yields. This is stable: for any fixed g the gain of the loop over the network is multiplied by
// g, and the spring to the peer is softer under the same damping. A falling g removes energy from that spring. A rising
// g adds at most K_p J_n e^2/2 over soft_start_s. Therefore g may fall at once, but rises slowly. The same ramp is the
// soft start after each engagement.
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

  // The motion that the drive may follow under gain g. Towards the end of the range the peer's velocity fades out, and
  // so does the part of its force that exceeds the hand's: otherwise the force would push the hand on although the
  // position reference ends there. The fade acts as a spring of K_f |f_r + f| / kFade (50 rad/s at 0.5 N m). It is 1.5
  // degrees wide, because a fade within one degree oscillates behind an MCU, whose loop is 8 ms late.
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

  // An act of the patient's side begins another session. Warmth and energy are kept.
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
