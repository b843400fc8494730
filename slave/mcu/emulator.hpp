// The orthosis without hardware: the MCU core as it runs in the firmware, on the simulated series-elastic orthosis, in
// virtual time by whole MCU loops.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "common/plant/world.hpp"
#include "slave/mcu/mcu_params.hpp"
#include "slave/mcu/serial_line.hpp"

namespace farhand {

class OrthosisEmulator {
 public:
  struct Params {
    mcu::McuSettings mcu;
    SeriesElasticWorld::Params world;
    WorldNumerics numerics = {};
  };

  // Throws std::invalid_argument if a parameter does not fit the core or the world.
  explicit OrthosisEmulator(const Params& params)
      : core_params_(mcu::make_mcu_params(params.mcu)),
        core_(core_params_),
        world_(params.world, params.numerics),
        loop_s_(1.0 / params.mcu.loop_hz),
        sensor_nm_(params.mcu.spring_sensor_nm),
        joint_unit_rad_(mcu::encoder_unit_rad(params.world.actuator.joint_counts_per_rev)),
        motor_unit_rad_(mcu::encoder_unit_rad(params.world.actuator.motor_counts_per_rev)) {}

  void receive(std::uint8_t byte) noexcept { core_.receive(byte); }

  // One MCU loop: the world moves up to it under the last command, then the core reads its encoders. True when `wire`
  // holds a frame to send. The first tick is at 0 s.
  bool tick(std::uint8_t wire[mcu::kWireBytes]) noexcept {
    if (ticks_ > 0) world_.advance(mcu::to_rad_s(output_.motor_velocity), loop_s_ * (ticks_ - world_since_));
    ++ticks_;
    if (!powered_) return false;
    if (hung_loops_ > 0) {
      if (--hung_loops_ == 0) reset_mcu(mcu::kWatchdogReset);
      return false;
    }
    mcu::McuInput input{};
    input.joint_counts = joint_.read(counts(world_.encoder(), joint_unit_rad_));
    input.motor_counts = motor_.read(counts(world_.motor_encoder(), motor_unit_rad_));
    input.temperature_c = 25;
    input.stop = stop_;
    input.release = release_;
    if (sensor_nm_ > 0) {
      const double torque = world_.truth().spring_torque;
      const double counts = std::clamp(spring_sensor_.read(torque) / sensor_nm_, -1.0, 1.0) * mcu::kSensorCounts;
      input.sensor = static_cast<std::int16_t>(std::lround(std::isfinite(counts) ? counts : mcu::kSensorCounts));
      const double current = std::fmin(std::fabs(torque) / mcu::kMotorTorqueNmPerA, 3.99) * mcu::kCurrentCounts;
      input.current = static_cast<std::uint16_t>(std::isfinite(current) ? current : 0);
    }
    output_ = core_.step(input);
    return core_.telemetry(wire);
  }

  // The MCU restarts, as after a brown-out; the motor stands until its next loop.
  void reset_mcu(mcu::Restart why = mcu::kBrownOut) noexcept {
    ++restarts_;
    core_ = mcu::OrthosisMcu(core_params_, static_cast<std::uint8_t>(why | (restarts_ << 4)));
    output_ = {};
  }

  // It hangs; the motor keeps its last command until the chip's watchdog resets it.
  void hang_mcu() noexcept { hung_loops_ = static_cast<int>(kChipWatchdogS / loop_s_); }
  // Without supply the MCU does not run, and the drive, whose enable is pulled down, stands.
  void supply(bool present) noexcept {
    if (present && !powered_) reset_mcu();
    if (!present) output_ = {};
    powered_ = present;
  }
  bool supplied() const noexcept { return powered_; }

  // Faults of the hardware. An encoder with an offset has slipped on its shaft; a frozen one keeps its last reading.
  struct Encoder {
    std::int32_t off = 0;
    bool frozen = false;
    std::int32_t shown = 0;
    std::int32_t read(std::int32_t counts) noexcept {
      if (!frozen) shown = counts;
      return shown + off;
    }
  };
  Encoder& joint_encoder() noexcept { return joint_; }
  Encoder& motor_encoder() noexcept { return motor_; }
  struct SpringSensor {
    double factor = 1.0;  // 0: dead, -1: its wires are swapped
    bool stuck = false;
    double shown = 0.0;
    double read(double torque) noexcept {
      if (!stuck) shown = factor * torque;
      return shown;
    }
  };
  SpringSensor& spring_sensor() noexcept { return spring_sensor_; }
  // Replaces the orthosis by another one, whose time starts at 0.
  void replace_world(const SeriesElasticWorld::Params& params) {
    world_ = SeriesElasticWorld(params);
    world_since_ = ticks_ - 1;
  }

  // The patient's buttons.
  void press_stop(bool pressed) noexcept { stop_ = pressed; }
  void press_release(bool pressed) noexcept { release_ = pressed; }

  // Time of the next tick.
  Nanoseconds next_tick() const noexcept { return from_seconds(loop_s_ * ticks_); }
  const mcu::OrthosisMcu& core() const noexcept { return core_; }
  const mcu::McuOutput& output() const noexcept { return output_; }
  const SeriesElasticWorld& world() const noexcept { return world_; }

 private:
  // An angle beyond the counter, or of a world that has left all bounds, becomes a count that the core finds
  // implausible.
  std::int32_t counts(double angle, double unit) const noexcept {
    constexpr std::int32_t kImplausible = std::numeric_limits<std::int32_t>::min();
    const double count = angle / unit;
    const bool shown = std::fabs(count) < 2147483647.0 && world_.status() != IntegratorStatus::kDiverged;
    return shown ? static_cast<std::int32_t>(std::lround(count)) : kImplausible;
  }

  static constexpr double kChipWatchdogS = 0.015;

  mcu::McuParams core_params_;
  mcu::OrthosisMcu core_;
  SeriesElasticWorld world_;
  double loop_s_, sensor_nm_, joint_unit_rad_, motor_unit_rad_;
  bool stop_ = false, release_ = false;
  bool powered_ = true;
  Encoder joint_, motor_;
  SpringSensor spring_sensor_;
  int hung_loops_ = 0;
  unsigned restarts_ = 0;
  double ticks_ = 0, world_since_ = 0;
  mcu::McuOutput output_{};
};

// The emulator at the end of its serial cable, as the PC's port sees it in virtual time.
class OrthosisOnSerial {
 public:
  OrthosisOnSerial(const OrthosisEmulator::Params& params, double serial_one_way_s)
      : emulator_(params), to_mcu_(serial_one_way_s), to_pc_(serial_one_way_s) {}

  void send(const std::uint8_t* bytes, std::size_t count, Nanoseconds now) noexcept { to_mcu_.send(bytes, count, now); }
  void drop_unsent(Nanoseconds now) noexcept { to_mcu_.drop_unsent(now); }
  // The emulator's time stood still, but the time of the cable did not: the bytes that wait there, and `bytes`, have
  // arrived, so that the MCU acts on the newest command.
  void catch_up(std::span<const std::uint8_t> bytes) noexcept {
    std::uint8_t byte = 0;
    while (to_mcu_.take(byte)) emulator_.receive(byte);
    for (const std::uint8_t one : bytes) emulator_.receive(one);
  }
  std::size_t waiting() const noexcept { return to_mcu_.waiting(); }
  bool receive(Nanoseconds now, std::uint8_t& byte) noexcept { return to_pc_.receive(now, byte); }

  // All MCU loops up to and including `now`.
  void advance(Nanoseconds now) noexcept {
    while (emulator_.next_tick() <= now) {
      const Nanoseconds tick = emulator_.next_tick();
      std::uint8_t byte = 0;
      while (to_mcu_.receive(tick, byte)) emulator_.receive(byte);
      std::uint8_t wire[mcu::kWireBytes];
      if (emulator_.tick(wire)) to_pc_.send(wire, mcu::kWireBytes, tick);
    }
  }

  OrthosisEmulator& emulator() noexcept { return emulator_; }
  const OrthosisEmulator& emulator() const noexcept { return emulator_; }

 private:
  OrthosisEmulator emulator_;
  SerialLine to_mcu_, to_pc_;
};

}  // namespace farhand
