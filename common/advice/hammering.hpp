// Does a hit on a wall die out? The roots of the slave's loop know contact that stays closed. Who hits a wall lets go
// of it again, and above some force gain the law throws the axis back as hard as it came: it hammers for ever, far
// below the gain at which closed contact would swing.
//
// Told by letting the slave's law hit the scene's wall while the remote side stands still behind it. All there is grows
// with the hit (without friction, weight and limits), so that one hard hit tells of all softer ones that its bounces
// come down to, and only the share of the speed that the wall gives back matters, not how hard the wall is.
#pragma once

#include "common/advice/scene_loops.hpp"

namespace farhand {

// Of a slave that takes a torque.
bool hits_die_out(const scene::Scene& scene, const Contact& wall);

}  // namespace farhand
