// The emulated orthosis as a scene describes it, for farhand-mcu and the virtual-time lab alike.
#pragma once

#include "proto/scene.pb.h"
#include "slave/mcu/emulator.hpp"

namespace farhand {

// The scene must be complete, as load_scene returns it.
OrthosisEmulator::Params emulator_params(const scene::Scene& scene);

}  // namespace farhand
