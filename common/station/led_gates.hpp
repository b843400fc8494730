// The last gate of an axis that its own station leads, in homing, identification and sweep.
#pragma once

#include <algorithm>
#include <limits>

#include "common/station/params.hpp"

namespace farhand {

// Range and torque differ from those of a session, because the range is not yet known.
inline GateParams homing_gate(const StationParams& params) noexcept {
  const DriveParams& drive = params.control.drive;
  GateParams gate = drive.gate;
  gate.torque = std::min(gate.torque, 2 * params.homing.torque + drive.model.gravity + drive.model.coulomb);
  gate.velocity = 2 * params.homing.speed;
  gate.range_min = -std::numeric_limits<double>::infinity();
  gate.range_max = std::numeric_limits<double>::infinity();
  return gate;
}

inline GateParams identifying_gate(const StationParams& params) noexcept {
  const DriveParams& drive = params.control.drive;
  GateParams gate = drive.gate;
  gate.torque = std::min(gate.torque, params.identifying.torque + drive.model.gravity);
  return gate;
}

inline GateParams sweeping_gate(const StationParams& params) noexcept {
  const DriveParams& drive = params.control.drive;
  GateParams gate = drive.gate;
  gate.torque = std::min(gate.torque, params.sweeping.torque + drive.model.gravity);
  return gate;
}

}  // namespace farhand
