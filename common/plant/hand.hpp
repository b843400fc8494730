// The patient's hand: spring and damper around a rest angle, in the orthosis from one time until another. A hand that
// is put in at a deflection pushes at once. This jump of torque is real, and the model keeps it.
//
//   torque = k(t) (x - x_rest(t)) + b v - tremor sin(w t) + c (|v| - v_0) sign(v) while stretched
//
// A spastic muscle also resists a fast stretch: motion away from the rest angle, faster than v_0. At v_0 this torque
// begins without a jump; a motion that is already fast when it passes the rest angle is resisted at once. A patient who
// moves by himself moves the rest angle and does work; the damper of the tissue still acts on the joint. When muscle
// tone falls, the stored energy of the stretch is lost.
#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "common/integrate/affine.hpp"
#include "common/plant/plant_mode.hpp"
#include "common/plant/power_flow.hpp"

namespace farhand {

class Hand {
 public:
  struct Params {
    double stiffness = 2;
    double damping = 0.02;
    double rest = 0;
    double from = 0;  // s
    double until = 1e9;
    double spastic = 0;           // N m s/rad; 0: not spastic
    double spastic_above = 0.2;   // rad/s
    double rest_amplitude = 0;    // rad, around rest; phase counted from 0 s, not from the time when the hand is put in
    double rest_frequency = 0.3;  // Hz
    std::optional<double> relaxed = std::nullopt;  // N m/rad, at most stiffness; to which it falls once the hand is in
    double relax_time = 5;                         // s, of the exponential
    double tremor = 0;                             // N m, zero at 0 s
    double tremor_frequency = 5;                   // Hz
  };
  static constexpr std::size_t kGuards = 2;  // stretched upwards, downwards

  explicit Hand(const Params& params)
      : p_(params),
        omega_(2.0 * std::numbers::pi * params.rest_frequency),
        tremor_omega_(2.0 * std::numbers::pi * params.tremor_frequency),
        moves_(params.rest_amplitude != 0),
        trembles_(params.tremor != 0),
        acts_(moves_ || trembles_ || params.relaxed) {}

  bool present(double t) const noexcept { return t >= p_.from && t < p_.until; }
  bool spastic() const noexcept { return p_.spastic != 0; }
  // True if it exerts a torque that varies with time.
  bool acts() const noexcept { return acts_; }
  // nullptr if it is affine in every mode, with a forcing of one sine; else why not.
  const char* not_affine() const noexcept {
    if (p_.relaxed) return "the stiffness of the hand follows the time";
    return moves_ && trembles_ ? "the hand moves and trembles at a frequency each" : nullptr;
  }
  // The first time after t at which the hand is put in or taken out.
  double next_break(double t) const noexcept {
    if (t < p_.from) return p_.from;
    return t < p_.until ? p_.until : std::numeric_limits<double>::infinity();
  }
  // The side of the stretch is relative to the given rest angle, also if the patient moves the rest angle: the length
  // of a muscle follows from the joint's angle.
  Mode mode_at(double t, double x, double v, double a = 0) const noexcept {
    if (!present(t)) return 0;
    if (!spastic()) return kHandPresent;
    const double v_0 = p_.spastic_above;
    const bool up = x > p_.rest && (v > v_0 || (v == v_0 && a > 0));
    const bool down = x < p_.rest && (v < -v_0 || (v == -v_0 && a < 0));
    return kHandPresent | (up ? kStretchedUp : 0u) | (down ? kStretchedDown : 0u);
  }

  // Reaction of a hand that is present, sign of Motion::f: positive resists positive motion.
  double reaction(Mode mode, double t, double x, double v) const noexcept {
    const double torque = spring_and_damper(x, v);
    if ((mode & kStretched) == 0 && !acts_) [[likely]]
      return torque;
    return torque + more(mode, t, x, v);
  }
  // The part that does not vary with time.
  template <class T>
  T still(Mode mode, T x, T v) const noexcept {
    return (mode & kStretched) != 0 ? spring_and_damper(x, v) + caught(mode, v) : spring_and_damper(x, v);
  }
  double reaction_rate(double t, double x) const noexcept {
    if (!acts_) return 0.0;
    return stiffness_rate(t) * (x - rest_at(t)) - stiffness(t) * rest_rate(t) - tremor_rate(t);
  }
  double stiffness(double t) const noexcept {
    if (!p_.relaxed) return p_.stiffness;
    return *p_.relaxed + (p_.stiffness - *p_.relaxed) * std::exp(-std::fmax(0.0, t - p_.from) / p_.relax_time);
  }
  double damping(Mode mode) const noexcept { return p_.damping + ((mode & kStretched) != 0 ? p_.spastic : 0.0); }

  // Not stretched: the joint is on the other side of the rest angle, or slow. Once stretched it moves away from the
  // rest angle, so that only the speed can end this mode.
  std::array<double, kGuards> guards(Mode mode, double x, double v) const noexcept {
    const auto guard = [&](double s, Mode bit) {
      const double slow = p_.spastic_above - s * v;
      return (mode & bit) != 0 ? -slow : std::fmax(s * (p_.rest - x), slow);
    };
    return {guard(1.0, kStretchedUp), guard(-1.0, kStretchedDown)};
  }
  template <class T, std::size_t S>
  std::array<AffineGuard<T, S>, kGuards> guard_forms(Mode mode) const noexcept {
    using Guard = AffineGuard<T, S>;
    const auto guard = [&](T s, Mode bit) {
      const bool stretched = (mode & bit) != 0;
      AffineForm<T, S> other_side, speed;
      other_side.c[0] = -s;
      other_side.d = s * T(p_.rest);
      speed.c[1] = stretched ? s : -s;
      speed.d = stretched ? -T(p_.spastic_above) : T(p_.spastic_above);
      return stretched ? Guard{Guard::Kind::kOne, speed, {}} : Guard{Guard::Kind::kMax, speed, other_side};
    };
    return {guard(T(1), kStretchedUp), guard(T(-1), kStretchedDown)};
  }
  static constexpr Mode bit(std::size_t guard) noexcept { return guard == 0 ? kStretchedUp : kStretchedDown; }

  // The patient's own activity as a torque on the joint, if it is a single sine.
  template <class T>
  Forcing<T> forcing() const noexcept {
    if (trembles_) return {.begin = 0, .polynomial = {}, .omega = T(tremor_omega_), .sine = T(p_.tremor), .cosine = 0};
    return {
        .begin = 0, .polynomial = {}, .omega = T(omega_), .sine = T(p_.stiffness) * T(p_.rest_amplitude), .cosine = 0};
  }

  double stored_energy(double t, double x) const noexcept {
    const double stretch = x - rest_at(t);
    return 0.5 * stiffness(t) * stretch * stretch;
  }
  PowerFlow power(Mode mode, double t, double x, double v) const noexcept {
    PowerFlow flow{0.0, p_.damping * v * v};
    if (acts_) {
      const double stretch = x - rest_at(t);
      flow.supplied = tremor_at(t) * v - stiffness(t) * stretch * rest_rate(t);
      flow.dissipated -= 0.5 * stiffness_rate(t) * stretch * stretch;
    }
    if ((mode & kStretched) != 0) flow.dissipated += p_.spastic * (v - side(mode) * p_.spastic_above) * v;
    return flow;
  }
  const Params& params() const noexcept { return p_; }

 private:
  template <class T>
  T spring_and_damper(T x, T v) const noexcept {
    return T(p_.stiffness) * (x - T(p_.rest)) + T(p_.damping) * v;
  }
  template <class T>
  T caught(Mode mode, T v) const noexcept {
    return T(p_.spastic) * (v - T(side(mode)) * T(p_.spastic_above));
  }
  double more(Mode mode, double t, double x, double v) const noexcept {
    const double k = stiffness(t);
    const double torque = (k - p_.stiffness) * (x - p_.rest) - k * (rest_at(t) - p_.rest) - tremor_at(t);
    return (mode & kStretched) != 0 ? torque + caught(mode, v) : torque;
  }
  static double side(Mode mode) noexcept { return (mode & kStretchedUp) != 0 ? 1.0 : -1.0; }
  double rest_at(double t) const noexcept {
    return moves_ ? p_.rest + p_.rest_amplitude * std::sin(omega_ * t) : p_.rest;
  }
  double rest_rate(double t) const noexcept { return moves_ ? p_.rest_amplitude * omega_ * std::cos(omega_ * t) : 0.0; }
  double stiffness_rate(double t) const noexcept {
    return p_.relaxed && t >= p_.from ? (*p_.relaxed - stiffness(t)) / p_.relax_time : 0.0;
  }
  double tremor_at(double t) const noexcept { return trembles_ ? p_.tremor * std::sin(tremor_omega_ * t) : 0.0; }
  double tremor_rate(double t) const noexcept {
    return trembles_ ? p_.tremor * tremor_omega_ * std::cos(tremor_omega_ * t) : 0.0;
  }

  Params p_;
  double omega_, tremor_omega_;  // rad/s
  bool moves_, trembles_, acts_;
};

}  // namespace farhand
