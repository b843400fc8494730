// Measures the friction of the own device. With nothing in it, its own station leads the axis through its range and
// back, twice, at 5 degrees per second, and the reaction is evaluated (common/identify/loop_friction.hpp).
//
// The axis follows the position stiffly: the reaction that is read is given back to the law, so that friction does not
// make it lag. Therefore something in the way raises the torque steadily, by about 1 N m/s. The sweep ends at kMost,
// soon enough for the torque to stay below 0.5 N m. The torque of a direct drive is besides limited by sweeping_gate().
#pragma once

#include "common/identify/loop_friction.hpp"
#include "common/signal/motion.hpp"
#include "common/station/engagement.hpp"

namespace farhand {

struct SweepingParams {
  double low = -0.3, high = 0.3;  // rad, turning points
  double torque = 0.5;            // N m, largest torque on anything
};

class Sweeping {
 public:
  Sweeping(const SweepingParams& params, double dt_s) noexcept;

  // x: present angle, to which the axis is led back at the end, rad.
  void begin(double x) noexcept;

  // The motion to follow; only the position acts.
  Motion<1> step(const Motion<1>& local, int ticks) noexcept;

  SweepingProgress progress() const noexcept { return progress_; }
  const LoopFriction& found() const noexcept { return found_; }  // once it is over

  static constexpr double kSteepest = 0.2;  // N m/rad: a steeper middle line of the loop is a hand's

 private:
  static constexpr double kSpeed = 0.0873;      // rad/s, 5 degrees per second: friction without viscosity
  static constexpr double kAcceleration = 1.0;  // rad/s2; J_n times it is below the encoder's noise
  static constexpr double kRest = 0.25;         // s, before each way
  static constexpr double kSettled = 0.12;      // rad after a reversal: most tendons have taken up their friction
  static constexpr double kShare = 0.25;        // of the range, where that is shorter
  static constexpr double kMost = 0.4;          // N m, largest reaction
  static constexpr double kInTheWay = 0.1;      // rad, largest lag
  static constexpr double kReaction = 20e-3;    // s, over which the reaction is averaged against kMost
  static constexpr double kUneven = 0.25;       // largest spread, as a share of F_c,
  static constexpr double kUnevenLeast = 0.02;  // N m, or this
  static constexpr int kWays = 6;               // to the low end, four sweeps, and back

  bool sweeps() const noexcept { return way_ > 0 && way_ < kWays - 1; }
  double goal() const noexcept;
  void judge(std::size_t rounds) noexcept;

  SweepingParams params_;
  double dt_s_;
  LoopFrictionFit fit_;
  LoopFriction found_;
  SweepingProgress progress_ = SweepingProgress::kUnderway;
  double start_ = 0.0, x_ = 0.0, v_ = 0.0, rested_s_ = 0.0, reaction_ = 0.0;
  int way_ = 0;
};

}  // namespace farhand
