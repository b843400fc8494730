// A station and the axis it stands on: one tick of one side, whatever drives the time. The programs and the
// virtual-time lab run exactly this.
#pragma once

#include "common/scene/station.hpp"

namespace farhand {

// What a station stands on: a simulated world, or a device behind a serial line.
template <class A>
concept Axis = requires(A axis, double t_s, const typename A::Drive::Command& command) {
  { axis.read(t_s) }
  noexcept->std::same_as<typename A::Drive::Sensed>;
  { axis.write(command, t_s) }
  noexcept;
};

template <template <class> class Scene, Axis A>
struct Side {
  using StationType = Station<Scene<typename A::Drive>>;

  template <class... Args>
  explicit Side(const StationParams& params, Args&&... axis_args)
      : station(params), axis(std::forward<Args>(axis_args)...) {}

  StationType station;
  A axis;

  // now: monotonic clock of this side; t_s: time of the run. Returns the packet for the peer.
  Packet<1> tick(Nanoseconds now, double t_s, OperatorAct act, int ticks) noexcept {
    const auto out = station.tick(now, axis.read(t_s), act, ticks);
    axis.write(out.command, t_s);
    return out.packet;
  }
};

}  // namespace farhand
