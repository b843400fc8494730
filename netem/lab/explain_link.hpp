// The link of a scene without anything around it.
#pragma once

#include <cstddef>

#include "proto/scene.pb.h"

namespace farhand {

// A packet per tick on its way there. Returns how many came.
std::size_t carry(const scene::Scene& scene, std::size_t ticks);
std::size_t link_bytes();

}  // namespace farhand
