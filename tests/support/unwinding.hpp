// How long the spring of the orthosis keeps its torque once the MCU commands none. The motor turns back as fast as it
// may, once it has gathered speed, and it has to take back what the hand yields by as well:
//
//   t = 1 / w_motor + (f - 0.1 N m)(1/k + 1/K) / v_motor
//
// That is the best that any law could do where the hand does not move by itself. One that does swings about it, by a
// quarter of its period with the spring, 2 pi / sqrt((k + K) / J). The loop that brings the rest to zero, with 100/s,
// costs 4 ms behind a motor of 4 rad/s, and 7 ms where it is slower than a motor of 8 rad/s could be.
#pragma once

#include <cmath>

#include "common/plant/series_elastic_plant.hpp"

namespace farhand {

constexpr double kUnwoundNm = 0.1;

inline double fastest_unwinding_s(const SeriesElasticParams::Actuator& a, double hand_nm_per_rad, double torque_nm) {
  const double way = std::fmax(std::fabs(torque_nm) - kUnwoundNm, 0.0) * (1 / a.spring + 1 / hand_nm_per_rad);
  return 1 / (2 * M_PI * a.motor_bandwidth_hz) + way / a.motor_speed_limit;
}
inline double swing_s(const SeriesElasticParams::Actuator& a, double hand_nm_per_rad) {
  return M_PI / 2 / std::sqrt((a.spring + hand_nm_per_rad) / a.J);
}
constexpr double kUnwindingLoopS = 0.007;

}  // namespace farhand
