// A spring and damper that touches from one side only and never pulls. Walls and mechanical stops are made of it.
//
//   torque = side max(0, k p + b p'),  p = side (x - at) > 0          p: penetration
//
// Without the max the damper would hold the axis back on its way out. Energy never comes out of it: what the clipped
// torque does not return is counted as dissipated.
#pragma once

#include "common/plant/power_flow.hpp"

namespace farhand {

struct OneSidedSpring {
  double stiffness = 0;  // N m/rad
  double damping = 0;    // N m s/rad
  double at = 0;         // rad
  double side = 1;       // +1 resists motion above at, -1 below

  // Reaction, sign of Motion::f: positive resists positive motion.
  double reaction(double x, double v) const noexcept {
    const double p = penetration(x);
    if (!(p > 0)) return 0.0;
    const double push = stiffness * p + damping * side * v;
    return push > 0 ? side * push : 0.0;
  }
  double stored_energy(double x) const noexcept {
    const double p = penetration(x);
    return p > 0 ? 0.5 * stiffness * p * p : 0.0;
  }
  double dissipated_power(double x, double v) const noexcept {
    const double p = penetration(x);
    return p > 0 ? (reaction(x, v) - side * stiffness * p) * v : 0.0;
  }

 private:
  double penetration(double x) const noexcept { return side * (x - at); }
};

}  // namespace farhand
