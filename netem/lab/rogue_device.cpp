#include "netem/lab/rogue_device.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace farhand::rogue {
namespace {

constexpr int kLetGoLoops = 4;  // without any torque commanded

std::int16_t counts(double value, double per_unit) noexcept {
  return static_cast<std::int16_t>(std::clamp(std::lround(value * per_unit), -32767l, 32767l));
}

}  // namespace

// Loop by loop, so that nothing between two ticks of the PC is missed.
void WatchedPort::advance(double t_s) noexcept {
  const Nanoseconds now = from_seconds(t_s);
  OrthosisEmulator& emulator = orthosis_.emulator();
  while (emulator.next_tick() <= now) {
    const Nanoseconds loop = emulator.next_tick();
    const double at = to_seconds(loop);
    while (!to_mcu_.empty() && to_mcu_.front().due_s <= at) {
      orthosis_.send(&to_mcu_.front().byte, 1, loop);
      to_mcu_.pop_front();
    }
    const bool stands = frozen(frozen_from_s_, at);
    emulator.joint_encoder().frozen = stands;
    orthosis_.advance(loop);
    if (!see_) continue;
    const SeriesElasticWorld::Truth world = emulator.world().truth();
    if (!stands) shown_ = world.x;
    const double commanded = mcu::to_nm(emulator.core().torque_command());
    // An MCU that let go by itself drives nobody, whatever its station was told.
    since_torque_ = commanded != 0 ? 0 : since_torque_ + 1;
    see_({.t_s = at,
          .body = {.x = world.x,
                   .v = world.v,
                   .motor_x = world.motor_x,
                   .motor_v = world.motor_v,
                   .x_shown = shown_,
                   .x_slow = shown_ - mcu::to_rad_s(emulator.core().velocity()) / velocity_cutoff_,
                   .t_s = at},
          .torque = world.f,
          .spring = world.spring_torque,
          .commanded = commanded,
          .driven = since_torque_ < kLetGoLoops});
  }
}

double WatchedPort::late_by(double delay_s, double t_s) const noexcept {
  if (!lies_at(t_s)) return 0;
  return lies_.creeping ? delay_s * std::min(1.0, t_s - engaged_s_ - lies_.from_s) : delay_s;
}

std::size_t WatchedPort::read(std::span<std::uint8_t> bytes, double t_s) noexcept {
  advance(t_s);
  std::uint8_t byte = 0;
  if (!lying_) {
    std::size_t count = 0;
    while (count < bytes.size() && orthosis_.receive(from_seconds(t_s), byte)) bytes[count++] = byte;
    return count;
  }
  while (orthosis_.receive(from_seconds(t_s), byte)) {
    if (!decoder_.push(byte)) continue;
    mcu::Telemetry telemetry = mcu::unpack_telemetry(decoder_.payload());
    forge(telemetry, t_s);
    std::array<std::uint8_t, mcu::kWireBytes> wire{};
    mcu::encode(telemetry, wire.data());
    double due = t_s + late_by(lies_.to_pc_s, t_s);
    if (!to_pc_.empty()) due = std::max(due, to_pc_.back().due_s);
    for (const std::uint8_t b : wire) to_pc_.push_back({due, b});
  }
  std::size_t count = 0;
  for (; count < bytes.size() && !to_pc_.empty() && to_pc_.front().due_s <= t_s; ++count) {
    bytes[count] = to_pc_.front().byte;
    to_pc_.pop_front();
  }
  return count;
}

bool WatchedPort::write(std::span<const std::uint8_t> bytes, double t_s) noexcept {
  if (!lying_) {
    orthosis_.send(bytes.data(), bytes.size(), from_seconds(t_s));
    return true;
  }
  double due = t_s + late_by(lies_.to_mcu_s, t_s);
  if (!to_mcu_.empty()) due = std::max(due, to_mcu_.back().due_s);
  for (const std::uint8_t b : bytes) to_mcu_.push_back({due, b});
  return true;
}

void WatchedPort::forge(mcu::Telemetry& telemetry, double t_s) noexcept {
  if (!lies_at(t_s)) {
    angle_shown_ = telemetry.angle;
    torque_shown_ = telemetry.torque;
    return;
  }
  const double t = t_s - engaged_s_ - lies_.from_s;
  const auto swing = [&](double hz) { return std::cos(2 * std::numbers::pi * hz * t); };
  if (lies_.angle_frozen) telemetry.angle = angle_shown_;
  if (lies_.torque_frozen) telemetry.torque = torque_shown_;
  telemetry.angle = counts(mcu::angle_rad(telemetry) + lies_.angle * swing(lies_.angle_hz), mcu::kAngleCountsPerRad);
  telemetry.torque = counts(lies_.torque_factor * mcu::torque_nm(telemetry) + lies_.torque * swing(lies_.torque_hz),
                            mcu::kTorqueCountsPerNm);
  if (lies_.state >= 0) telemetry.state = static_cast<mcu::State>(lies_.state & 3);
  if (lies_.page >= 0 && (telemetry.seq & 15) == lies_.page) telemetry.slow = lies_.page_value;
  if (lies_.seq_lies) telemetry.seq = static_cast<std::uint8_t>((telemetry.seq * 3) & 63);
}

}  // namespace farhand::rogue
