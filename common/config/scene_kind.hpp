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

// Counts per turn of the coarser of the two encoders from which a station derives its velocity; infinite if both are
// ideal.
double coarsest_counts(const scene::Scene& scene);
// Cut-off of the velocity where a scene names none, rad/s. One count makes a step of g_v * count in the velocity, and
// so a pull of K_d g_v count on the other side. At 500 rad/s and 20000 counts that is 6 rad/s2. At 4096 counts it would
// be 31 rad/s2, which shakes a light hand for ever; 200 rad/s leave 12. That is also the pull of 10000 counts at
// 500 rad/s, so the cut-off changes there. Only for the mediator: its loops do not cross the network. 3 ms more of lag
// would take stability from loops that do.
double default_g_v(const scene::Scene& scene);

// If the sides differ in size, their common loop is analysed in the size of the master: angles of the slave are divided
// by position_scale, its torques multiplied by force_scale. K_f of the law is then the slave's divided by both scales.
Scale scale_of(const scene::Scene& scene);
double master_K_f(const scene::Scene& scene);

}  // namespace farhand
