// From a checked scene to the constants of the simulated world.
#pragma once

#include "common/plant/direct_slave_world.hpp"
#include "common/plant/master_world.hpp"
#include "common/plant/series_elastic_world.hpp"
#include "proto/scene.pb.h"

namespace farhand {

// The scene must be complete, as load_scene returns it.
MasterWorld::Params master_world_params(const scene::Scene& scene);
DirectSlaveWorld::Params direct_slave_world_params(const scene::Scene& scene);
SeriesElasticWorld::Params series_elastic_world_params(const scene::Scene& scene);

}  // namespace farhand
