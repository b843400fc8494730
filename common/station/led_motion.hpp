// The motions by which a station leads its own axis, independent of the peer: homing, identification, sweep. Each has a
// last gate of its own.
#pragma once

#include "common/station/engagement.hpp"
#include "common/station/homing.hpp"
#include "common/station/identifying.hpp"
#include "common/station/params.hpp"
#include "common/station/sweeping.hpp"

namespace farhand {

class LedMotion {
 public:
  // identifying: null where the scene does not ask for it.
  LedMotion(const StationParams& p, Identifying* identifying)
      : homing_(p.homing, p.control.drive.K, p.control.drive.dt_s),
        identifying_(identifying),
        sweeping_(p.sweeping, p.control.drive.dt_s) {}

  // In the states of the functions below.
  static constexpr bool leads(StationState state) noexcept {
    return StateSet{StationState::kHoming, StationState::kIdentifying, StationState::kSweeping}.has(state);
  }

  // x: present angle, rad. Returns the last gate until the end. p: those of the constructor.
  GateParams begin(StationState state, double x, const StationParams& p) noexcept;

  // The motion to follow.
  Motion<1> step(StationState state, const Motion<1>& local, int ticks) noexcept;

  // While identifying, once per tick: angle read, rad; torque applied, N m; periods since the last call.
  void sample(double x, double torque, int ticks) noexcept { identifying_->sample(x, torque, ticks); }

  void report(EngagementInputs& in) const noexcept {
    in.homing = homing_.progress();
    if (identifying_ != nullptr) in.identifying = identifying_->progress();
    in.sweeping = sweeping_.progress();
  }

  // Results, once the motion is over.
  const Homing& homing() const noexcept { return homing_; }
  Misfit misfit() const noexcept { return identifying_->misfit(); }  // after identification
  const LoopFriction& swept() const noexcept { return sweeping_.found(); }

 private:
  Homing homing_;
  Identifying* identifying_;
  Sweeping sweeping_;
};

}  // namespace farhand
