// A side made of a station and an axis.
#pragma once

#include <utility>

#include "common/runtime/any_station.hpp"
#include "common/runtime/side.hpp"

namespace farhand {

// What a station stands on: a simulated world, or a device behind a serial line.
template <class A>
concept Axis = requires(A axis, double t_s, const typename A::Io::Command& command) {
  { axis.read(t_s) }
  noexcept->std::same_as<typename A::Io::Sensed>;
  { axis.write(command, t_s) }
  noexcept;
  { axis.truth() }
  noexcept->std::same_as<Truth>;
};

template <Axis A>
class SideOf final : public Side {
 public:
  template <class... Args>
  explicit SideOf(const StationParams& params, Args&&... axis_args)
      : station_(make_station<typename A::Io>(params)), axis_(std::forward<Args>(axis_args)...) {}

  Packet<1> tick(Nanoseconds now, double t_s, OperatorAct act, int ticks) noexcept override {
    const typename A::Io::Sensed sensed = axis_.read(t_s);
    device_valid_ = sensed.valid;
    const auto out = station_->tick(now, sensed, act, ticks);
    axis_.write(out.command, t_s);
    return out.packet;
  }
  Receipt receive(const Packet<1>& packet, Nanoseconds now) noexcept override { return station_->receive(packet, now); }

  bool carries_energy() const noexcept override { return station_->carries_energy(); }

  const TickTrace<1>& trace() const noexcept override { return station_->trace(); }
  const Receiver<1>& receiver() const noexcept override { return station_->receiver(); }
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
  std::unique_ptr<AnyStation<typename A::Io>> station_;
  A axis_;
  bool device_valid_ = false;
};

}  // namespace farhand
