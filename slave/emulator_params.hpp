// The emulated orthosis as a scene describes it, for farhand-mcu and the virtual-time lab alike.
#pragma once

#include "proto/scene.pb.h"
#include "slave/mcu/emulator.hpp"

namespace farhand {

// The scene must be complete, as load_scene returns it. Throws std::invalid_argument, with the name of the field, for a
// value that the integers of the MCU cannot hold.
OrthosisEmulator::Params emulator_params(const scene::Scene& scene);

}  // namespace farhand
