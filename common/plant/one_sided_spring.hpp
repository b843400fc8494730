// A spring and damper that touches from one side only and never pulls. Walls, mechanical stops and the end of a
// spring's range are made of it.
//
//   torque = side max(0, k p + b p'),  p = side (x - at) > 0          p: penetration
//
// Without the max the damper would hold the axis back on its way out. Energy never comes out of it: what the clipped
// torque does not return is counted as dissipated. It has two modes, open and pushing, and is linear in both: in a mode
// it stays so beyond the mode's end, where an integrator looks for the instant of touching or leaving.
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

  // Does it push? Exactly on the border: if the axis goes in, or is at rest and accelerated in.
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
  // Not negative while the mode holds. Open: it may lie in the spring without pushing, on a fast way out.
  template <class T>
  T guard(bool pushing, T x, T v) const noexcept {
    const T torque = push(x, v);
    return pushing ? torque : -std::min(penetration(x), torque);
  }

  // The same as a form of a state that begins with x and v.
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

  // What it leaves of a range.
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
