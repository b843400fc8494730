// Is the step short enough for the stiffest thing that an axis can touch? Past the limit RK4 explodes, and the run
// would show a motion that no controller caused.
#pragma once

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "common/integrate/rk4.hpp"

namespace farhand {

// Largest |s| of J s^2 + damping s + stiffness = 0, complex or real: never above this.
inline double fastest_rate(double J, double stiffness, double damping) {
  return std::max(std::sqrt(stiffness / J), damping / J);
}

inline void check_world_step(double step, double rate) {
  const double longest = kRk4StableRadius / rate;
  if (step > 0 && step <= longest) return;
  std::ostringstream message;
  message << "world.step_s = " << step
          << " s is too long for this world: its fastest motion or stiffest contact needs more than 0 and at most "
          << longest << " s";
  throw std::invalid_argument(message.str());
}

}  // namespace farhand
