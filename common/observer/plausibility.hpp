// Checks whether the reading of an angle can be true: compares it, tick by tick, with the extreme motions of the axis.
// For one joint.
//
//   range    outside the angles that the joint can reach, or not a number
//   jump     further than top acceleration allows after the fastest of the last moments:
//            |dx| <= (v + a dt (n + 1)/2) n dt + q,   n periods since the last reading, q one count
//   frozen   the reading stands although the axis cannot stand. There are two tests:
//            the axis moved, and not even the stiffest hand stops it so fast:
//              J z'' = J a_0 - K z - B z' + dtau_m - s t,  z'(0) = v_0,  |z| > 2 q
//            the torque changed, and even the stiffest and heaviest object would have yielded:
//              J z'' = dtau - K z - B z',  |z| > 2 q,   dtau: change of torque beyond dry friction since it stands,
//              tau = f + f'/g: the input of an observer of cut-off g whose velocity is 0
//
// A wall that throws the axis back gives it no more speed than it came with, but may do so within one tick. Therefore
// the largest speed of the last 50 ms counts and not the last speed.
//
// Frozen in motion: v_0 and a_0 are those of the last readings, less the error that two counts can cause. K is the
// stiffness of the stiffest hand, with critical damping and the least inertia. dtau_m is the braking torque of the
// motor as measured, s t the torque by which it may brake unmeasured. z never exceeds v_0/(e w), w^2 = K/J. Below v_0 =
// 2 e w q (0.17 rad/s; 0.7 with the speed that the counts may hide) a frozen encoder therefore cannot be distinguished
// from a hand that holds the axis.
//
// Frozen at rest: a hand at rest does not change its reaction, so the fault shows only when torque is applied. The
// velocity then reads 0, the observers take every torque for a reaction, and the disturbance observer feeds it back. A
// stop yields less than any hand; therefore nothing is judged near a stop.
#pragma once

#include <array>
#include <cstdint>

#include "common/signal/cutoff.hpp"

namespace farhand {

enum class Implausible : std::uint8_t { kNo, kRange, kJump, kFrozen };

struct PlausibilityParams {
  double stop_min = -0.349, stop_max = 0.349;  // rad, of the device
  double resolution = 3.2e-4;                  // rad: one count, of encoder or telemetry
  double top_acceleration = 3000.0;            // rad/s2
  Cutoff g_reac = Cutoff::rad_s(200);          // of the observer that the reaction comes from
  double settle_s = 0.020;                     // until its velocity is 0 once the reading stands
  // The object that may stop the axis.
  double least_inertia = 3e-3;  // kg m2
  double hand_stiffness = 30;   // N m/rad
  double unseen_nm_per_s = 0;   // rate at which the motor may change the torque behind a spring
  // The stiffest and heaviest object in the axis, with the axis itself and its control included.
  double inertia = 8e-3;   // kg m2
  double stiffness = 100;  // N m/rad
  double damping = 0.0;    // N m s/rad; at least critical, so that it never overshoots
  double friction = 0.03;  // N m that may change sides without motion
  double dt_s = 1e-3;
};

class Plausibility {
 public:
  explicit Plausibility(const PlausibilityParams& params) noexcept;

  struct Reading {
    double x = 0.0;    // rad
    double f = 0.0;    // N m, reaction torque as observed
    double tau = 0.0;  // N m, held since the last reading; 0 if unknown
  };
  // periods: of the device since the reading before; 0: the same reading again. ticks: of this side since the last
  // call. The time between two readings is the larger of both: if the first reading arrived late and the second in
  // time, their samples are further apart than their arrivals. After any result but kNo the check starts anew with the
  // next reading.
  Implausible step(const Reading& now, int periods = 1, int ticks = 1) noexcept;

  // The next reading may have any angle, because the device was lost.
  void reset() noexcept { seen_ = 0; }

 private:
  static constexpr double kBeyondStops = 0.1745;  // rad, 10 degrees: stops yield, and zero angles are not exact
  static constexpr double kNearStop = 0.0349;     // rad, 2 degrees
  static constexpr int kMemory = 50;              // ticks
  static constexpr int kMostSpan = 8;             // ticks

  // Motion of an object from the angle at which the reading came to stand.
  struct Course {
    double inertia, stiffness, damping;
    double z = 0.0, v = 0.0;
    double step(double torque, double dt) noexcept;
  };

  Implausible judge(const Reading& now, int ticks) noexcept;
  double fastest() const noexcept { return speed_[0] > speed_[1] ? speed_[0] : speed_[1]; }
  void remember(double speed, int ticks) noexcept;
  void note(const Reading& now) noexcept;
  bool should_have_gone_on(double tau) noexcept;
  bool should_have_yielded(double f) noexcept;

  PlausibilityParams p_;
  int settle_ticks_;
  int span_;              // ticks over which a speed is taken
  double a_;              // of the observer's low-pass
  int seen_ = 0;          // readings since the start; the first two give no speed before them
  int waited_ = 0;        // ticks since the last new reading
  double speed_[2] = {};  // largest of this stretch of kMemory ticks, and of the one before
  int in_stretch_ = 0;
  int still_ = 0;  // ticks for which the reading stood

  std::array<Reading, 2 * kMostSpan + 1> last_{};  // the newest last
  int in_a_row_ = 0;                               // number of these in successive periods
  Course gone_on_;
  double way_ = 1.0, braking_ = 0.0, tau_moving_ = 0.0;  // when it came to stand: +-1; N m; N m
  double tau_still_ = 0.0;                               // torque since then
  Course yielded_;
};

}  // namespace farhand
