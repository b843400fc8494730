// The device of the tested side, which gives the judge the person's true torque and motion: an axis that a torque
// drives, or an MCU whose telemetry may lie.
#pragma once

#include <deque>
#include <functional>

#include "common/device/mcu_axis.hpp"
#include "common/device/simulated_axis.hpp"
#include "netem/lab/rogue_judge.hpp"
#include "netem/lab/rogue_plan.hpp"
#include "slave/emulator_params.hpp"

namespace farhand::rogue {

template <class World>
class WatchedAxis {
 public:
  using Io = DirectIo<1>;

  WatchedAxis(const typename World::Params& params, const WorldNumerics& numerics, double frozen_from_s)
      : axis_(params, numerics), frozen_from_s_(frozen_from_s) {}

  Io::Sensed read(double t_s) noexcept {
    Io::Sensed sensed = axis_.read(t_s);
    if (!frozen(frozen_from_s_, t_s)) shown_ = sensed.x[0];
    sensed.x[0] = shown_;
    return sensed;
  }
  static constexpr bool kSimulated = true;
  void power_stage(const TorqueHold& contract) noexcept { axis_.power_stage(contract); }
  void write(const Io::Command& command, double t_s) noexcept {
    axis_.write(command, t_s);
    commanded_ = command.torque[0];
  }
  Truth truth() const noexcept { return axis_.truth(); }
  double commanded() const noexcept { return commanded_; }

 private:
  SimulatedAxis<World> axis_;
  double frozen_from_s_, shown_ = 0, commanded_ = 0;
};

// The serial cable and the orthosis behind it. The MCU itself is the real core; its telemetry is forged on the way.
class WatchedPort {
 public:
  using See = std::function<void(const AtPerson&)>;

  WatchedPort(const scene::Scene& scene, const Plan& plan, bool lies)
      : orthosis_(emulator_params(scene), scene.slave().series_elastic().serial_one_way_s()),
        frozen_from_s_(plan.world.frozen_from_s),
        velocity_cutoff_(scene.slave().mcu().g_v_rad_s()),
        lies_(plan.lies),
        lying_(lies) {}

  void watch(See see) { see_ = std::move(see); }
  void engaged(double t_s) noexcept { engaged_s_ = t_s; }

  std::size_t read(std::span<std::uint8_t> bytes, double t_s) noexcept;
  bool write(std::span<const std::uint8_t> bytes, double t_s) noexcept;
  void drop_unsent(double t_s) noexcept { orthosis_.drop_unsent(from_seconds(t_s)); }
  bool lost() noexcept { return false; }
  Truth truth() const noexcept {
    const SeriesElasticWorld::Truth world = orthosis_.emulator().world().truth();
    return {world.x, world.v, world.f};
  }

 private:
  struct Late {
    double due_s;
    std::uint8_t byte;
  };

  void advance(double t_s) noexcept;
  void forge(mcu::Telemetry& telemetry, double t_s) noexcept;
  bool lies_at(double t_s) const noexcept {
    return lying_ && engaged_s_ >= 0 && t_s >= engaged_s_ + lies_.from_s && t_s < engaged_s_ + lies_.until_s;
  }
  double late_by(double delay_s, double t_s) const noexcept;

  OrthosisOnSerial orthosis_;
  See see_;
  double frozen_from_s_, velocity_cutoff_, shown_ = 0;
  Lies lies_;
  bool lying_;
  double engaged_s_ = -1;
  mcu::FrameDecoder decoder_;
  std::deque<Late> to_pc_, to_mcu_;
  int since_torque_ = 0;  // loops of the MCU
  std::int16_t angle_shown_ = 0, torque_shown_ = 0;
};

}  // namespace farhand::rogue
