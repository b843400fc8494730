// The motion that one side sends of its axis: position, velocity, and the reaction torque of the person or environment.
#pragma once

#include "common/signal/joints.hpp"

namespace farhand {

// Sign convention of the whole project: J a = tau - f. A reaction f that resists positive motion is positive. Therefore
// a therapist who pushes in the positive direction gives f_m < 0, a slave that presses the hand in the positive
// direction gives f_s > 0, and ideally f_m + f_s = 0.
template <int N>
struct Motion {
  Joints<N> x = Joints<N>::Zero();  // position, rad
  Joints<N> v = Joints<N>::Zero();  // velocity, rad/s
  Joints<N> f = Joints<N>::Zero();  // reaction torque on the actuator, N m

  bool finite() const noexcept { return x.allFinite() && v.allFinite() && f.allFinite(); }
};

}  // namespace farhand
