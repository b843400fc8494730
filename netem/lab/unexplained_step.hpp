// How far the motion to follow stepped beyond what explains it: the motions that it may come from or go to, at the
// velocities seen around the tick, and the speed of alignment (a smoothstep is at most 1.5 times as fast as its mean of
// 0.3 rad/s).
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
