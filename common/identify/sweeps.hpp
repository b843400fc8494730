// The motion by which an axis is identified: to and fro between two angles, at a quarter, half and all of a speed, from
// rest to rest with a constant acceleration at both ends. The angles are bounded here, the torque by the gate.
#pragma once

#include "common/signal/motion.hpp"

namespace farhand {

struct SweepsParams {
  double low = -0.25, high = 0.25;  // rad, turning points
  double speed = 1.0;               // rad/s, of the fastest sweeps
  double acceleration = 8.0;        // rad/s2
  int rounds = 6;                   // of six sweeps each
};

class Sweeps {
 public:
  Sweeps(const SweepsParams& params, double dt_s) noexcept : params_(params), dt_s_(dt_s) {}

  // x: present angle, to which the axis is led back at the end, rad.
  void begin(double x) noexcept;

  // The motion to follow; its force is 0.
  Motion<1> step(int ticks) noexcept;

  bool sweeping() const noexcept { return number_ > 0 && number_ <= 6 * params_.rounds; }
  bool done() const noexcept { return number_ > 6 * params_.rounds + 2; }
  double duration_s() const noexcept;  // from begin() to done(), without the ways to the first sweep and back

 private:
  static constexpr double kRest = 0.25;  // s, before each way
  // Share by which sweeps differ from each other: equal sweeps would meet the encoder's counts in the same way, and
  // errors that repeat do not show as scatter.
  static constexpr double kVary = 0.1;

  struct Way {
    double from, to, speed;
  };
  static double scattered(int number) noexcept;
  double turning_point(int number) const noexcept;
  Way way(int number) const noexcept;
  double acceleration_time(const Way& way) const noexcept;
  double duration(const Way& way) const noexcept;

  SweepsParams params_;
  double dt_s_;
  double start_ = 0.0, t_ = 0.0;
  int number_ = 0;  // 0 leads to the low end, the last but one leads back
};

}  // namespace farhand
