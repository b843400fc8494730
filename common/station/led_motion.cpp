#include "common/station/led_motion.hpp"

#include <algorithm>
#include <limits>

namespace farhand {

GateParams LedMotion::begin(StationState state, double x, const StationParams& p) noexcept {
  const DriveParams& drive = p.control.drive;
  GateParams gate = drive.gate;
  if (state == StationState::kHoming) {
    homing_.begin(x);
    gate.torque = std::min(gate.torque, 2 * p.homing.torque + drive.model.gravity + drive.model.coulomb);
    gate.velocity = 2 * p.homing.speed;
    gate.range_min = -std::numeric_limits<double>::infinity();  // the range is not yet known
    gate.range_max = std::numeric_limits<double>::infinity();
  } else if (state == StationState::kIdentifying) {
    identifying_->begin(x);
    gate.torque = std::min(gate.torque, p.identifying.torque + drive.model.gravity);
  } else {
    sweeping_.begin(x);
    gate.torque = std::min(gate.torque, p.sweeping.torque + drive.model.gravity);
  }
  return gate;
}

Motion<1> LedMotion::step(StationState state, const Motion<1>& local, int ticks) noexcept {
  if (state == StationState::kHoming) return homing_.step(local, ticks);
  if (state == StationState::kIdentifying) return identifying_->step(local, ticks);
  return sweeping_.step(local, ticks);
}

}  // namespace farhand
