// The kind of a scene: its device, its architecture, and the scale between its sides.
#pragma once

#include <string_view>

#include "common/station/params.hpp"
#include "proto/scene.pb.h"

namespace farhand {

bool is_elastic(const scene::Scene& scene);
// True if the law of either side has this block: common/law/architectures.hpp.
bool has_block(const scene::Scene& scene, std::string_view block);
bool has_cdob(const scene::Scene& scene);
bool is_mediated(const scene::Scene& scene);  // or may become so
bool has_sdcv(const scene::Scene& scene);
bool is_two_channel(const scene::Scene& scene);
bool has_passivity_controllers(const scene::Scene& scene);

// If the sides differ in size, their common loop is analysed in the size of the master: angles of the slave are divided
// by position_scale, its torques multiplied by force_scale. K_f of the law is then the slave's divided by both scales.
Scale scale_of(const scene::Scene& scene);
double master_K_f(const scene::Scene& scene);

}  // namespace farhand
