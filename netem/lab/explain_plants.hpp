// Which integrator the worlds of a scene get, with the stiffness estimate behind it, and what comes with it.
#pragma once

#include "netem/lab/explain.hpp"

namespace farhand {

// Adds the plants themselves, event location and stiff integrators to the blocks, and the choices.
void explain_plants(const scene::Scene& scene, Explanation& explanation);

}  // namespace farhand
