// Does bouncing after a hit on a wall die out? The roots of the slave's loop describe only contact that stays closed.
// An axis that hits a wall leaves it again. Above some force gain the law throws it back at the wall as fast as it
// came, and it bounces for ever, at a gain far below the one at which closed contact oscillates.
//
// The answer is found by simulation: the slave's law hits the scene's wall while the remote side stands still behind
// it. The model is linear in the impact speed (it has no friction, weight or limits). Therefore one hard hit represents
// all softer ones to which its bounces decay. Only the share of the speed that the wall returns matters, not the wall's
// stiffness.
#pragma once

#include "common/advice/scene_loops.hpp"

namespace farhand {

// For a slave that takes a torque.
bool hits_die_out(const scene::Scene& scene, const Contact& wall);

}  // namespace farhand
