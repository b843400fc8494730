// Of what kind a scene is: its device, its architecture, and how its sides differ in size.
#pragma once

#include <string_view>

#include "common/station/params.hpp"
#include "proto/scene.pb.h"

namespace farhand {

bool is_elastic(const scene::Scene& scene);
// Whether the law of either side consists of it: common/law/architectures.hpp.
bool has_block(const scene::Scene& scene, std::string_view block);
bool has_cdob(const scene::Scene& scene);
bool is_mediated(const scene::Scene& scene);  // or may become so
bool has_sdcv(const scene::Scene& scene);
bool is_two_channel(const scene::Scene& scene);
bool has_passivity_controllers(const scene::Scene& scene);

// Where the sides differ in size, their common loop is looked at in the size of the master: angles of the slave over
// position_scale, its torques times force_scale. Its law's K_f is then the slave's over both scales.
Scale scale_of(const scene::Scene& scene);
double master_K_f(const scene::Scene& scene);

}  // namespace farhand
