// A side made of a station and an axis.
#pragma once

#include <concepts>
#include <stdexcept>
#include <string>
#include <utility>

#include "common/runtime/owned_station.hpp"
#include "common/runtime/side.hpp"

namespace farhand {

template <class A>
concept TakesTorque = requires(const typename A::Io::Command& command) {
  command.torque;
};

// The axis of a station: a simulated world, or a device behind a serial line. An axis that takes a torque declares
// whether it is simulated, and gets, before the loop, the behaviour of its drive when commands cease.
template <class A>
concept Axis = requires(A axis, double t_s, const typename A::Io::Command& command) {
  { axis.read(t_s) }
  noexcept->std::same_as<typename A::Io::Sensed>;
  { axis.write(command, t_s) }
  noexcept;
  { axis.truth() }
  noexcept->std::same_as<Truth>;
}
&&(!TakesTorque<A> || requires(A axis, const TorqueHold& contract) {
  { A::kSimulated } -> std::convertible_to<bool>;
  axis.power_stage(contract);
});

template <Axis A>
class SideOf final : public Side {
 public:
  template <class... Args>
  explicit SideOf(const StationParams& params, Args&&... axis_args)
      : station_(params), axis_(std::forward<Args>(axis_args)...) {
    if constexpr (TakesTorque<A>) axis_.power_stage(contract_of(params));
    if constexpr (requires { axis_.ticks_every(0.001); }) axis_.ticks_every(params.control.drive.dt_s);
  }

  Packet<1> tick(Nanoseconds now, double t_s, OperatorAct act, int ticks) noexcept override {
    const typename A::Io::Sensed sensed = axis_.read(t_s);
    device_valid_ = sensed.valid;
    const auto out = station_.tick(now, sensed, act, ticks);
    axis_.write(out.command, t_s);
    return out.packet;
  }
  void know(const KnownFriction& friction) noexcept override { station_.know(friction); }
  void go_on(double t_s) noexcept override {
    if constexpr (requires { axis_.go_on(t_s); }) axis_.go_on(t_s);
    if constexpr (requires { axis_.port.go_on(t_s); }) axis_.port.go_on(t_s);
  }
  Receipt receive(const Packet<1>& packet, Nanoseconds now) noexcept override { return station_.receive(packet, now); }

  PacketParts packet_parts() const noexcept override {
    return {.energy = station_.needs().account, .previous = station_.needs().previous};
  }

  const TickTrace<1>& trace() const noexcept override { return station_.trace(); }
  const Receiver<1>& receiver() const noexcept override { return station_.receiver(); }
  Truth truth() const noexcept override { return axis_.truth(); }
  SerialCounters serial_counters() const noexcept override {
    if constexpr (requires { axis_.counters(); }) {
      return axis_.counters();
    } else {
      return {};
    }
  }
  bool device_valid() const noexcept override { return device_valid_; }

  A& axis() noexcept { return axis_; }
  const A& axis() const noexcept { return axis_; }

 private:
  // A simulated drive keeps the default contract. The behaviour of a real drive is known only from its scene.
  static const TorqueHold& contract_of(const StationParams& params) {
    const DriveParams& drive = params.control.drive;
    if constexpr (TakesTorque<A> && !A::kSimulated) {
      if (!drive.power_stage_named) {
        const std::string side = params.role == Role::kLeader ? "master" : "slave";
        throw std::invalid_argument(side + ".power_stage: the drive of a motor that is not simulated needs " + side +
                                    ".power_stage.hold_s and " + side +
                                    ".power_stage.fall_s in the scene: for how many s it holds a torque after the last "
                                    "command, and within how many s it then lets it fall to zero by itself");
      }
    }
    return drive.power_stage;
  }

  OwnedStation<typename A::Io> station_;
  A axis_;
  bool device_valid_ = false;
};

}  // namespace farhand
