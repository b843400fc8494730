// Which method a world gets, and whether its step is short enough for the stiffest thing that can be touched. Past the
// limit an explicit method explodes, and the run would show a motion that no controller caused.
#pragma once

#include "common/integrate/method.hpp"
#include "common/integrate/rk4.hpp"

namespace farhand {

// A mode of rate |s| is damped by semi-implicit Euler while |s| h stays below this: 2 (sqrt 2 - 1), that of a mode
// which is critically damped. An undamped one would go to 2.
constexpr double kSemiImplicitStableRadius = 0.828;

// Throws std::invalid_argument with the limit and the value. rate: fastest of the plant, 1/s.
void check_stable(Method method, double rate, double step);

template <class P>
Method auto_method(const P& plant, double step) {
  if (plant.not_affine() == nullptr) return Method::kClosedForm;
  return plant.fastest_rate() * step <= kRk4StableRadius ? Method::kRk4 : Method::kSdirk2;
}

}  // namespace farhand
