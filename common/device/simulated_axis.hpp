// A simulated world in place of the motor and encoder of a station, with its power stage: between two ticks the torque
// is held; when ticks cease it falls.
#pragma once

#include <algorithm>

#include "common/device/truth.hpp"
#include "common/plant/world.hpp"
#include "common/signal/torque_hold.hpp"
#include "common/station/drive_io.hpp"

namespace farhand {

// World: MasterWorld or DirectSlaveWorld. Time starts with the first read.
template <class World>
class SimulatedAxis {
 public:
  using Io = DirectIo<1>;
  static constexpr bool kSimulated = true;

  explicit SimulatedAxis(const typename World::Params& params, const WorldNumerics& numerics = {})
      : world_(params, numerics) {}

  void power_stage(const TorqueHold& contract) noexcept { power_stage_ = contract; }

  // Advances the world to t_s (time of the world) under the torque that the power stage gives after the last write.
  Io::Sensed read(double t_s) noexcept {
    go_on(t_s);
    Io::Sensed sensed;
    // A world that has diverged stands still from then on: its encoder would look like that of a hand at rest.
    sensed.valid = world_.status() != IntegratorStatus::kDiverged;
    sensed.x[0] = world_.encoder();
    return sensed;
  }
  void write(const Io::Command& command, double t_s) noexcept {
    torque_ = command.torque[0];
    written_s_ = t_s;
  }

  // Advances the world like read(), while the program does not run.
  void go_on(double t_s) noexcept {
    const double held_until = written_s_ + power_stage_.hold_s, over = written_s_ + power_stage_.over_s();
    if (torque_ != 0.0 && t_s > held_until) {
      advance(held_until, torque_);
      for (int k = 0; k < kPieces; ++k) {
        const double share = (k + 1.0) / kPieces;
        advance(std::min(t_s, held_until + share * power_stage_.fall_s), (1.0 - share + 0.5 / kPieces) * torque_);
      }
      if (t_s >= over) torque_ = 0.0;
    }
    advance(t_s, torque_);
  }

  // At the time of the last read, under the torque that led there.
  Truth truth() const noexcept {
    const auto truth = world_.truth();
    return {truth.x, truth.v, truth.f};
  }

 private:
  static constexpr int kPieces = 8;  // of the fall, each at its mean

  void advance(double t_s, double torque) noexcept {
    if (t_s <= t_s_) return;
    world_.advance(torque, t_s);
    t_s_ = t_s;
  }

  World world_;
  TorqueHold power_stage_;
  double torque_ = 0.0, written_s_ = 0.0;
  double t_s_ = 0.0;
};

}  // namespace farhand
