// The link of a scene without anything around it.
#pragma once

#include <cstddef>

#include "proto/scene.pb.h"

namespace farhand {

// Sends a packet per tick over the forward path. Returns the number of arrivals.
std::size_t carry(const scene::Scene& scene, std::size_t ticks);
std::size_t link_bytes();

}  // namespace farhand
