// The thresholds of the SDCV, estimated from the patient: f_2 from the hand, f_1 from the friction of its device.
//
//   f_2 = 0.3 |k (x - x_0)| at the largest deflection seen          f_1 = F_c, within 0.25 and 0.9 of f_2
//
// F_c counts as 0.03 N m at least, because the observers leave a torque of that size in free motion without contact.
//
// k and x_0 are those of the straight line closest to the slave's angle and torque under load (Deming: both coordinates
// have errors), while it is pressed and released, in both directions. Fixed thresholds fit only one patient: a hand of
// 0.5 N m/rad never reaches 0.75 N m, so its compensation stays, and the therapist feels half of the torque.
//
// The torque of a patient who moves actively or trembles does not stay on a line for long, and a stiff wall yields too
// little motion to fit a line. Then nothing is learnt, and the thresholds in force stay. Tendon friction
// (common/observer/tendon_friction.hpp) is subtracted from the torque first. A line that was fitted before the friction
// was estimated may have been friction and is forgotten.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "common/law/params.hpp"
#include "common/observer/fitted_line.hpp"
#include "common/observer/tendon_friction.hpp"
#include "common/signal/low_pass.hpp"

namespace farhand {

// Of one joint.
class PatientThresholds {
 public:
  // They start from those of the scene.
  PatientThresholds(const SdcvParams& scene, double dt_s)
      : learn_(LowPass<1>(Cutoff::rad_s(kLearn), dt_s).smoothing()),
        step_(kSpeed * dt_s),
        dt_s_(dt_s),
        f_1_(scene.f_1),
        f_2_(scene.f_2),
        aim_1_(scene.f_1),
        aim_2_(scene.f_2) {}

  // The next hand may be another one, or lie elsewhere. The thresholds in force stay until that hand is known.
  void reset() noexcept {
    forget();
    begun_ = false;
  }

  // x, f: the slave's angle and reaction as received, rad, N m.
  void step(double x, double f) noexcept {
    friction_.step(x, f);
    if (friction_.F_c() > 0.0 && !std::exchange(has_friction_, true)) forget();
    z_.step(x, friction_.L());
    const double f_hand = f - friction_.F_c() * z_.value();
    if (!std::exchange(begun_, true)) x_ = x, f_ = f_hand;
    x_ += learn_ * (x - x_);
    f_ += learn_ * (f_hand - f_);
    const double touch = std::max(kTouch, kOfFriction * friction_.F_c());
    pressed_ = std::abs(f_) > (pressed_ ? kRelease * touch : touch);
    if (pressed_) identify();
    // An active push that happens to rise with the angle also lies on a line, but soon leaves it.
    const bool on_line = alike_ && std::abs(f_ - fitted(x_)) < std::max(kRelease * touch, kOff * std::abs(f_));
    if (pressed_) held_s_ = on_line ? held_s_ + dt_s_ : 0.0;
    if (pressed_ && held_s_ > kHolds) name();
    f_1_ += std::clamp(aim_1_ - f_1_, -step_, step_);
    f_2_ += std::clamp(aim_2_ - f_2_, -step_, step_);
  }

  double f_1() const noexcept { return f_1_; }  // N m, in force
  double f_2() const noexcept { return f_2_; }
  double named() const noexcept { return named_; }  // N m: estimated f_2 of the patient; 0 before the first estimate
  double k() const noexcept { return k_; }          // N m/rad

 private:
  static constexpr double kOfLargest = 0.3;                // f_2 as a share of the largest torque of the fitted line
  static constexpr double kLowest = 0.25, kHighest = 0.9;  // bounds of f_1 as shares of f_2
  static constexpr double kUntold = 0.03;                  // N m, lower bound of F_c
  static constexpr double kSpeed = 0.5;                    // N m/s, at which estimated thresholds take effect
  static constexpr double kLearn = 50.0;                   // rad/s
  static constexpr double kTouch = 0.05, kRelease = 0.4;   // N m, and release as a share; noise of 0.024 becomes 0.004
  static constexpr double kOfFriction = 0.5;               // share of F_c; a wrong L leaves less of the friction
  static constexpr double kMemory = 0.995;                 // forgetting factor per sample: 0.4 rad of motion
  static constexpr double kEnough = 8.0;                   // samples
  static constexpr double kAlike = 0.8;                    // square of the correlation
  static constexpr double kHolds = 1.0, kOff = 0.2;        // s that a line must hold, pressed; of the torque

  void forget() noexcept {
    line_.forget();
    lowest_ = highest_ = held_s_ = 0.0;
    pressed_ = alike_ = false;
  }

  void identify() noexcept {
    const bool first = line_.samples() == 0.0;
    lowest_ = first ? x_ : std::min(lowest_, x_);
    highest_ = first ? x_ : std::max(highest_, x_);
    if (!line_.add(x_, f_) || line_.samples() < kEnough) return;
    const double xf = line_.xf();
    alike_ = line_.moved() && xf > 0.0 && xf * xf > kAlike * line_.xx() * line_.ff();
    if (!alike_) return;
    k_ = line_.slope();
    f_0_ = line_.f() - k_ * line_.x();
  }

  double fitted(double x) const noexcept { return f_0_ + k_ * x; }

  void name() noexcept {
    named_ = kOfLargest * std::max(std::abs(fitted(lowest_)), std::abs(fitted(highest_)));
    aim_2_ = named_;
    aim_1_ = std::clamp(std::max(friction_.F_c(), kUntold), kLowest * named_, kHighest * named_);
  }

  double learn_, step_, dt_s_;
  double f_1_, f_2_, aim_1_, aim_2_;
  double named_ = 0.0, k_ = 0.0, f_0_ = 0.0, held_s_ = 0.0;
  TendonFriction friction_;
  Hysteresis z_;
  double x_ = 0.0, f_ = 0.0, lowest_ = 0.0, highest_ = 0.0;
  FittedLine line_{kMemory};
  bool begun_ = false, has_friction_ = false, pressed_ = false, alike_ = false;
};

template <int N>
using PatientsThresholds = std::array<PatientThresholds, static_cast<std::size_t>(N)>;

// Of every joint.
template <int N>
PatientsThresholds<N> patients_thresholds(const SdcvParams& scene, double dt_s) {
  return [&]<std::size_t... I>(std::index_sequence<I...>) {
    return PatientsThresholds<N>{((void)I, PatientThresholds(scene, dt_s))...};
  }
  (std::make_index_sequence<static_cast<std::size_t>(N)>{});
}

}  // namespace farhand
