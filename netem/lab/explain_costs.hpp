// Time of the blocks of a scene.
#pragma once

#include "netem/lab/explain.hpp"

namespace farhand {

// Runs the scene, then each contained block alone on what it saw in that run.
void add_costs(const LoadedScene& loaded, Explanation& explanation);

}  // namespace farhand
