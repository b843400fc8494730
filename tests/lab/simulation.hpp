// The whole session in virtual time: both stations, the codec, the link and the simulated world, from one seed. No
// clock, no thread, no socket: the same numbers every time, on every machine.
#pragma once

#include <functional>
#include <memory>

#include "common/config/load.hpp"
#include "common/record/session.hpp"

namespace farhand {

// Runs a scene to its end. `progress` (may be empty) is told the virtual time once per virtual second.
Session simulate(const LoadedScene& loaded, const std::function<void(double)>& progress = {});

}  // namespace farhand
