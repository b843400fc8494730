// Where an axis stands whose encoder only counts: led slowly to one mechanical stop, which is known by standing still
// against a reaction, and back.
//
// The law turns a lead of the motion to follow into torque, K_f f = K_p lead + K_d v, so a bounded lead is a bounded
// torque on whatever is in the way. To be done without a hand in the device: a hand that resists is taken for the stop.
#pragma once

#include "common/law/params.hpp"
#include "common/signal/motion.hpp"
#include "common/station/engagement.hpp"
#include "common/station/gate_params.hpp"

namespace farhand {

struct HomingParams {
  double stop = 0.0;    // rad, the angle that the stop gets
  double back = 0.0;    // rad, where the axis is led then; from here the stop lies in the direction of the sweep
  double speed = 0.1;   // rad/s
  double torque = 0.2;  // N m, against what is in the way
};

class Homing {
 public:
  Homing(const HomingParams& params, const FourChannelGains& K, double dt_s)
      : params_(params), lead_(params.torque * K.K_f / K.K_p), dt_s_(dt_s), way_(params.stop > params.back ? 1 : -1) {}

  // x: where it stands now, counted from anywhere. Everything stays counted so until the end.
  void begin(double x) noexcept;

  // The motion to follow.
  Motion<1> step(const Motion<1>& local, int ticks) noexcept;

  HomingProgress progress() const noexcept { return progress_; }
  double zero() const noexcept { return zero_; }  // once done: what is to be added to every angle

 private:
  static constexpr double kStill = 2e-3;    // rad
  static constexpr double kStill_s = 0.2;   // within kStill for so long: it stands
  static constexpr double kThere = 0.0175;  // rad, 1 degree

  HomingParams params_;
  double lead_, dt_s_;
  double way_;  // sign of the direction now
  bool returns_ = false;
  HomingProgress progress_ = HomingProgress::kUnderway;
  double x_ref_ = 0.0, x_still_ = 0.0, still_s_ = 0.0, zero_ = 0.0;
};

}  // namespace farhand
