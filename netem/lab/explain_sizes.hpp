// Bytes of the blocks of a scene.
#pragma once

#include "netem/lab/explain.hpp"

namespace farhand {

// Sizes by the compiler, of each block, station and side.
void add_sizes(const scene::Scene& scene, Explanation& explanation);

}  // namespace farhand
