// The patient's hand: spring and damper around a rest angle, in the orthosis from one time until another. Put in at a
// deflection, it pushes at once: that is what happens at the bedside, and the jump is left as it is.
//
//   torque = k (x - x_rest(t)) + b v + c (|v| - v_0) sign(v) while stretched
//
// A spastic muscle resists a fast stretch besides: motion away from the rest angle, faster than v_0. There it begins
// without a jump; a motion that is fast already as it passes the rest angle is caught at once. A patient who moves by
// himself moves the rest angle: by his work, with the tissue's damper still on the joint.
#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <numbers>

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
    double rest_amplitude = 0;    // rad, around rest; counted from 0 s, not from when the hand is put in
    double rest_frequency = 0.3;  // Hz
  };
  static constexpr std::size_t kGuards = 2;  // stretched upwards, downwards

  explicit Hand(const Params& params)
      : p_(params), omega_(2.0 * std::numbers::pi * params.rest_frequency), moves_(params.rest_amplitude != 0) {}

  bool present(double t) const noexcept { return t >= p_.from && t < p_.until; }
  bool spastic() const noexcept { return p_.spastic != 0; }
  bool moves() const noexcept { return moves_; }
  // The first time after t at which it comes or goes.
  double next_break(double t) const noexcept {
    if (t < p_.from) return p_.from;
    return t < p_.until ? p_.until : std::numeric_limits<double>::infinity();
  }
  // The side counts from the rest angle that is given, also where the patient moves it: a muscle is as long as the
  // joint makes it.
  Mode mode_at(double t, double x, double v, double a = 0) const noexcept {
    if (!present(t)) return 0;
    if (!spastic()) return kHandPresent;
    const double v_0 = p_.spastic_above;
    const bool up = x > p_.rest && (v > v_0 || (v == v_0 && a > 0));
    const bool down = x < p_.rest && (v < -v_0 || (v == -v_0 && a < 0));
    return kHandPresent | (up ? kStretchedUp : 0u) | (down ? kStretchedDown : 0u);
  }

  // All of a hand that is present. Reaction, sign of Motion::f: positive resists positive motion.
  double reaction(Mode mode, double t, double x, double v) const noexcept {
    const double torque = still(mode, x, v);
    return moves_ ? torque - p_.stiffness * (rest_at(t) - p_.rest) : torque;
  }
  // Without what comes and goes with the time.
  template <class T>
  T still(Mode mode, T x, T v) const noexcept {
    const T torque = T(p_.stiffness) * (x - T(p_.rest)) + T(p_.damping) * v;
    if ((mode & kStretched) == 0) return torque;
    return torque + T(p_.spastic) * (v - T(side(mode)) * T(p_.spastic_above));
  }
  double reaction_rate(double t) const noexcept { return moves_ ? -p_.stiffness * rest_rate(t) : 0.0; }
  double stiffness() const noexcept { return p_.stiffness; }
  double damping(Mode mode) const noexcept { return p_.damping + ((mode & kStretched) != 0 ? p_.spastic : 0.0); }

  // Not stretched: it is on the other side of the rest angle, or slow. Once stretched it goes away from the rest angle,
  // so that only the speed can end it.
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

  // What the patient does of himself, as a torque on the joint.
  template <class T>
  Forcing<T> forcing() const noexcept {
    return {
        .begin = 0, .polynomial = {}, .omega = T(omega_), .sine = T(p_.stiffness) * T(p_.rest_amplitude), .cosine = 0};
  }

  double stored_energy(double t, double x) const noexcept {
    const double stretch = x - rest_at(t);
    return 0.5 * p_.stiffness * stretch * stretch;
  }
  PowerFlow power(Mode mode, double t, double x, double v) const noexcept {
    PowerFlow flow{0.0, p_.damping * v * v};
    if (moves_) flow.supplied -= p_.stiffness * (x - rest_at(t)) * rest_rate(t);
    if ((mode & kStretched) != 0) flow.dissipated += p_.spastic * (v - side(mode) * p_.spastic_above) * v;
    return flow;
  }
  const Params& params() const noexcept { return p_; }

 private:
  static double side(Mode mode) noexcept { return (mode & kStretchedUp) != 0 ? 1.0 : -1.0; }
  double rest_at(double t) const noexcept {
    return moves_ ? p_.rest + p_.rest_amplitude * std::sin(omega_ * t) : p_.rest;
  }
  double rest_rate(double t) const noexcept { return p_.rest_amplitude * omega_ * std::cos(omega_ * t); }

  Params p_;
  double omega_;
  bool moves_;
};

}  // namespace farhand
