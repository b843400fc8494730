// What one side tells the other about its axis: where it is, how fast it moves, how hard the world pushes back.
#pragma once

#include "common/signal/joints.hpp"

namespace farhand {

// Sign convention of the whole project: J a = tau - f. A reaction f that resists positive motion is positive, so the
// therapist pushing in + shows as f_m < 0, the slave pressing in + on the hand as f_s > 0, and the ideal is
// f_m + f_s = 0.
template <int N>
struct Motion {
  Joints<N> x = Joints<N>::Zero();  // position, rad
  Joints<N> v = Joints<N>::Zero();  // velocity, rad/s
  Joints<N> f = Joints<N>::Zero();  // reaction torque on the actuator, N m

  bool finite() const noexcept { return x.allFinite() && v.allFinite() && f.allFinite(); }
};

}  // namespace farhand
