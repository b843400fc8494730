// Converts a checked scene to the constants of the simulated world.
#pragma once

#include "common/plant/world.hpp"
#include "proto/scene.pb.h"

namespace farhand {

// The scene must be complete, as load_scene returns it.
MasterWorld::Params master_world_params(const scene::Scene& scene);
DirectSlaveWorld::Params direct_slave_world_params(const scene::Scene& scene);
SeriesElasticWorld::Params series_elastic_world_params(const scene::Scene& scene);
WorldNumerics world_numerics(const scene::Scene& scene);

}  // namespace farhand
