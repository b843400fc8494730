// The integrators of a scene's worlds, with the stiffness estimates for the choice and the blocks that they need.
#pragma once

#include "netem/lab/explain.hpp"

namespace farhand {

// Adds the plants themselves, event location and stiff integrators to the blocks, and the choices.
void explain_plants(const scene::Scene& scene, Explanation& explanation);

}  // namespace farhand
