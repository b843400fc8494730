// The step of the motion to follow that is not explained by the motions from which it may come or to which it may go,
// at the velocities around the tick, or by the speed of alignment (a smoothstep is at most 1.5 times as fast as its
// mean of 0.3 rad/s).
#pragma once

#include <algorithm>
#include <initializer_list>

namespace farhand {

inline double unexplained_step(double change, double dt_s, std::initializer_list<double> velocities) {
  constexpr double kAlignSpeed = 1.5 * 0.3;  // rad/s
  const double fastest = std::max(0.0, std::max(velocities)), slowest = std::min(0.0, std::min(velocities));
  return std::max({0.0, change - (fastest + kAlignSpeed) * dt_s, (slowest - kAlignSpeed) * dt_s - change});
}

}  // namespace farhand
