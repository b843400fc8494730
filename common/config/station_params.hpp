// Converts a checked scene to the constants of the blocks of a station. Only here do these settings get their meaning
// in code.
#pragma once

#include "common/station/params.hpp"
#include "proto/scene.pb.h"

namespace farhand {

// The scene must be complete, as load_scene returns it.
StationParams master_station_params(const scene::Scene& scene, std::uint32_t session);
StationParams slave_station_params(const scene::Scene& scene, std::uint32_t session);

}  // namespace farhand
