// Which integrator a scene's worlds get, with the stiffness estimate behind it.
#pragma once

#include "tests/lab/explain.hpp"

namespace farhand {

void explain_plants(const scene::Scene& scene, Explanation& explanation);

}  // namespace farhand
