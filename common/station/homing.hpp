// Finds the angle of an axis whose encoder only counts. The axis is led slowly to one mechanical stop, and back. The
// stop is detected when the axis stands still against a reaction.
//
// The law turns a lead of the motion to follow into torque, K_f f = K_p lead + K_d v. A bounded lead therefore bounds
// the torque on an obstacle. Homing must be done without a hand in the device: a hand that resists is taken for the
// stop.
#pragma once

#include "common/law/params.hpp"
#include "common/signal/motion.hpp"
#include "common/station/engagement.hpp"
#include "common/station/gate_params.hpp"

namespace farhand {

struct HomingParams {
  double stop = 0.0;    // rad, angle of the stop
  double back = 0.0;    // rad, to which the axis is led afterwards; the sweep goes from here towards the stop
  double speed = 0.1;   // rad/s
  double torque = 0.2;  // N m, largest torque on an obstacle
};

class Homing {
 public:
  Homing(const HomingParams& params, const FourChannelGains& K, double dt_s)
      : params_(params), lead_(params.torque * K.K_f / K.K_p), dt_s_(dt_s), way_(params.stop > params.back ? 1 : -1) {}

  // x: present angle, with any zero. All angles keep this zero until the end.
  void begin(double x) noexcept;

  // The motion to follow.
  Motion<1> step(const Motion<1>& local, int ticks) noexcept;

  HomingProgress progress() const noexcept { return progress_; }
  double zero() const noexcept { return zero_; }  // once done: offset to add to every angle

 private:
  static constexpr double kStill = 2e-3;    // rad
  static constexpr double kStill_s = 0.2;   // if it stays within kStill for this time, it stands
  static constexpr double kThere = 0.0175;  // rad, 1 degree

  HomingParams params_;
  double lead_, dt_s_;
  double way_;  // sign of the present direction
  bool returns_ = false;
  HomingProgress progress_ = HomingProgress::kUnderway;
  double x_ref_ = 0.0, x_still_ = 0.0, still_s_ = 0.0, zero_ = 0.0;
};

}  // namespace farhand
