// A stiff object in the patient's box: it resists motion away from 0 beyond its angle, and never pulls.
#pragma once

#include "common/plant/one_sided_spring.hpp"

namespace farhand {

struct Wall : OneSidedSpring {
  struct Params {
    double stiffness = 1000;
    double damping = 0.4;
    double at = 0.1;  // its sign decides the side; 0 counts as positive
  };

  explicit Wall(const Params& params)
      : OneSidedSpring{params.stiffness, params.damping, params.at, params.at < 0 ? -1.0 : 1.0} {}
};

}  // namespace farhand
