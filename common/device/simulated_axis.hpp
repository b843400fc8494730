// A simulated world where the motor and encoder of a station would be. Between two ticks the torque is held, as a power
// stage holds it.
#pragma once

#include "common/device/truth.hpp"
#include "common/plant/world.hpp"
#include "common/scene/drive_io.hpp"

namespace farhand {

// World: MasterWorld or DirectSlaveWorld. Time starts with the first read.
template <class World>
class SimulatedAxis {
 public:
  using Io = DirectIo<1>;

  explicit SimulatedAxis(const typename World::Params& params, const WorldNumerics& numerics = {})
      : world_(params, numerics) {}

  // Advances the world to t_s (time of the world) under the torque of the last write.
  Io::Sensed read(double t_s) noexcept {
    if (t_s > t_s_) {
      world_.advance(torque_, t_s);
      t_s_ = t_s;
    }
    Io::Sensed sensed;
    // A world that left all bounds stands still from then on: its encoder would read like that of a hand at rest.
    sensed.valid = world_.status() != IntegratorStatus::kDiverged;
    sensed.x[0] = world_.encoder();
    return sensed;
  }
  void write(const Io::Command& command, double /*t_s*/) noexcept { torque_ = command.torque[0]; }

  // At the time of the last read, under the torque that led there.
  Truth truth() const noexcept {
    const auto truth = world_.truth();
    return {truth.x, truth.v, truth.f};
  }

 private:
  World world_;
  double torque_ = 0.0;
  double t_s_ = 0.0;
};

}  // namespace farhand
