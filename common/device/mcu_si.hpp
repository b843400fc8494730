// The PC's side of the MCU frames in SI: makes commands from references, and reads angle, torque and the values that
// the slow bytes carry.
#pragma once

#include <cmath>
#include <cstdint>

#include "common/device/mcu_frame.hpp"

namespace farhand {
namespace mcu {

// Nearest count, saturated at +-1 rad, +-8 rad/s, +-4 N m. A reference that is not finite gives a SAFE frame, because
// it must never become a number that looks intended.
inline Command make_command(Mode mode, std::uint8_t seq, double x_ref_rad, double v_ref_rad_s,
                            double f_ref_nm) noexcept {
  Command command;
  command.seq = seq & 15;
  if (!std::isfinite(x_ref_rad) || !std::isfinite(v_ref_rad_s) || !std::isfinite(f_ref_nm)) return command;
  const auto counts = [](double value, std::int32_t per_unit) {
    const double limited = std::fmin(std::fmax(value * per_unit, -kRefLimit), kRefLimit);
    return static_cast<std::int16_t>(std::lround(limited));
  };
  command.mode = mode;
  command.x_ref = counts(x_ref_rad, kXRefCountsPerRad);
  command.v_ref = counts(v_ref_rad_s, kVRefCountsPerRadPerS);
  command.f_ref = counts(f_ref_nm, kFRefCountsPerNm);
  return command;
}

inline Command make_stop(std::uint8_t seq) noexcept {
  Command command;
  command.seq = seq & 15;
  command.f_ref = kStopNow;
  return command;
}

inline double angle_rad(const Telemetry& telemetry) noexcept { return telemetry.angle / double{kAngleCountsPerRad}; }
inline double torque_nm(const Telemetry& telemetry) noexcept { return telemetry.torque / double{kTorqueCountsPerNm}; }

// Collected from the slow bytes; complete after sixteen frames in a row.
class SlowValues {
 public:
  void take(const Telemetry& telemetry) noexcept {
    const SlowPage page = slow_page(telemetry.seq);
    const std::uint8_t high = bytes_[static_cast<int>(page) - (page == SlowPage::kSpringTorqueHigh ? 0 : 1)];
    bytes_[static_cast<int>(page)] = telemetry.slow;
    // A low byte counts only directly after its high byte; after a lost frame the pair would mix two samples.
    const bool paired = telemetry.seq == ((previous_seq_ + 1) & 63);
    previous_seq_ = telemetry.seq;
    if (page == SlowPage::kSpringTorqueLow && paired) spring_torque_ = joined(high, telemetry.slow);
    if (page == SlowPage::kMotorAngleLow && paired) motor_angle_ = joined(high, telemetry.slow);
  }

  double spring_torque_nm() const noexcept { return spring_torque_ / double{kTorqueCountsPerNm}; }
  double motor_angle_rad() const noexcept { return motor_angle_ / double{kAngleCountsPerRad}; }
  double motor_speed_command_rad_s() const noexcept {
    return static_cast<std::int8_t>(byte(SlowPage::kMotorSpeedCommand)) / double{kMotorSpeedCountsPerRadPerS};
  }
  int temperature_c() const noexcept { return static_cast<std::int8_t>(byte(SlowPage::kTemperatureC)); }
  std::uint8_t faults() const noexcept { return byte(SlowPage::kFaults); }
  std::uint8_t crc_errors() const noexcept { return byte(SlowPage::kCrcErrors); }
  std::uint8_t framing_errors() const noexcept { return byte(SlowPage::kFramingErrors); }
  std::uint8_t overruns() const noexcept { return byte(SlowPage::kOverruns); }
  std::uint8_t firmware() const noexcept { return byte(SlowPage::kFirmware); }
  std::uint8_t restart() const noexcept { return byte(SlowPage::kRestart); }
  double motor_current_a() const noexcept { return byte(SlowPage::kCurrent) / double{kCurrentCountsPerA}; }
  std::uint8_t command_seq() const noexcept { return byte(SlowPage::kCommandEcho) & 15; }
  std::uint8_t happened() const noexcept { return byte(SlowPage::kCommandEcho) & (kBounded | kSagged); }

 private:
  static std::int16_t joined(std::uint8_t high, std::uint8_t low) noexcept {
    return static_cast<std::int16_t>((static_cast<std::uint16_t>(high) << 8) | low);
  }
  std::uint8_t byte(SlowPage page) const noexcept { return bytes_[static_cast<int>(page)]; }

  std::uint8_t bytes_[16] = {};
  std::uint8_t previous_seq_ = 63;
  std::int16_t spring_torque_ = 0;
  std::int16_t motor_angle_ = 0;
};

}  // namespace mcu
}  // namespace farhand
