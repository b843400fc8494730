// A spring and damper that acts in one direction only and never pulls. Walls, mechanical stops and the end of a
// spring's range consist of it.
//
//   torque = side max(0, k p + b p'),  p = side (x - at) > 0          p: penetration
//
// Without the max the damper would hold the axis back on its way out. The contact never generates energy: the energy
// that the clipped torque does not return counts as dissipated. It has two modes, open and pushing, and is linear in
// both. A mode stays linear beyond its end, where an integrator searches for the instant of touching or leaving.
#pragma once

#include <algorithm>

#include "common/integrate/affine.hpp"
#include "common/plant/plant_mode.hpp"
#include "common/plant/power_flow.hpp"

namespace farhand {

struct OneSidedSpring {
  double stiffness = 0;  // N m/rad
  double damping = 0;    // N m s/rad
  double at = 0;         // rad
  double side = 1;       // +1 resists motion above at, -1 below

  // True if it pushes. Exactly on the border: if the axis moves in, or is at rest and accelerated inward.
  bool pushes(double x, double v, double a = 0) const noexcept {
    const double p = penetration(x);
    if (p == 0) return side * v > 0 || (v == 0 && side * a > 0);
    return p > 0 && push(x, v) > 0;
  }
  // Reaction, sign of Motion::f: positive resists positive motion.
  template <class T>
  T reaction(bool pushing, T x, T v) const noexcept {
    return pushing ? T(side) * push(x, v) : T(0);
  }
  double reaction(double x, double v) const noexcept { return reaction(pushes(x, v), x, v); }
  // Not negative while the mode holds. In the open mode the axis may be inside the spring, if it moves out fast.
  template <class T>
  T guard(bool pushing, T x, T v) const noexcept {
    const T torque = push(x, v);
    return pushing ? torque : -std::min(penetration(x), torque);
  }

  // The same as a linear form of a state that begins with x and v.
  template <class T, std::size_t S>
  AffineGuard<T, S> guard_form(bool pushing) const noexcept {
    AffineForm<T, S> depth, torque;
    depth.c[0] = T(side);
    depth.d = -T(side) * T(at);
    torque.c[0] = T(stiffness) * T(side);
    torque.c[1] = T(damping) * T(side);
    torque.d = T(stiffness) * depth.d;
    if (pushing) return {AffineGuard<T, S>::Kind::kOne, torque, {}};
    return {AffineGuard<T, S>::Kind::kMax, negative(depth), negative(torque)};
  }

  // The part of a range that it leaves free.
  FreeRange free_range(const FreeRange& range) const noexcept {
    return side > 0 ? FreeRange{range.low, std::min(range.high, at)} : FreeRange{std::max(range.low, at), range.high};
  }

  double stored_energy(double x) const noexcept {
    const double p = std::max(0.0, penetration(x));
    return 0.5 * stiffness * p * p;
  }
  double dissipated_power(bool pushing, double x, double v) const noexcept {
    return pushing ? damping * v * v : -stiffness * std::max(0.0, penetration(x)) * side * v;
  }

 private:
  template <class T, std::size_t S>
  static AffineForm<T, S> negative(AffineForm<T, S> form) noexcept {
    for (T& c : form.c) c = -c;
    form.d = -form.d;
    return form;
  }
  template <class T>
  T penetration(T x) const noexcept {
    return T(side) * (x - T(at));
  }
  template <class T>
  T push(T x, T v) const noexcept {
    return T(stiffness) * penetration(x) + T(damping) * T(side) * v;
  }
};

}  // namespace farhand
