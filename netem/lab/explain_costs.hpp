// Time of the blocks of a scene.
#pragma once

#include "netem/lab/explain.hpp"

namespace farhand {

// Runs the scene, then each contained block alone on its inputs from that run.
void add_costs(const LoadedScene& loaded, Explanation& explanation);

}  // namespace farhand
