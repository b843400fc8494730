#pragma once

#include <cmath>
#include <cstdint>

#include "common/device/mcu_si.hpp"
#include "slave/mcu/mcu_params.hpp"

namespace farhand::mcu {

inline std::int32_t counts_of(double angle_rad, double counts_per_rev = 20000) {
  return static_cast<std::int32_t>(std::lround(angle_rad / encoder_unit_rad(counts_per_rev)));
}

// A core whose PC sends one frame every second loop, at angles that the test gives.
struct Bench {
  explicit Bench(const McuSettings& s = {}) : settings(s), core(make_mcu_params(s)) {}

  void send(const Command& command) {
    std::uint8_t wire[kWireBytes];
    encode(command, wire);
    for (const std::uint8_t byte : wire) core.receive(byte);
  }
  void send(Mode mode, double x_ref = 0, double v_ref = 0, double f_ref = 0) {
    send(make_command(mode, seq++, x_ref, v_ref, f_ref));
  }
  McuOutput loop(double x = 0, double x_motor = 0, bool overrun = false) {
    return core.step(
        {counts_of(x, settings.joint_counts_per_rev), counts_of(x_motor, settings.motor_counts_per_rev), 25, overrun});
  }
  McuOutput frame_time(double x = 0, double x_motor = 0) {
    loop(x, x_motor);
    return loop(x, x_motor);
  }
  // A joint that is held at x: the motor winds the spring up to the torque that is commanded, at winds_at at most.
  McuOutput held_loop(double x = 0) {
    const double goal = to_nm(core.torque_command()) / settings.spring;
    const double most = winds_at / settings.loop_hz;
    wound += std::fmin(std::fmax(goal - wound, -most), most);
    return loop(x, x + wound);
  }
  McuOutput held_frame_time(double x = 0) {
    held_loop(x);
    return held_loop(x);
  }
  // Into an active mode at rest at x with the start ramp over.
  void activate(Mode mode, double x = 0) {
    send(Mode::kSafe, x);
    frame_time(x, x);
    for (int i = 0; i < 60; ++i) {
      send(mode, x);
      frame_time(x, x);
    }
  }

  McuSettings settings;
  OrthosisMcu core;
  std::uint8_t seq = 0;
  double wound = 0;      // rad, of the spring
  double winds_at = 40;  // rad/s
};

// Of what is not about power.
inline McuSettings with_ample_power(McuSettings settings = {}) {
  settings.power_limit = 1e4;
  return settings;
}

}  // namespace farhand::mcu
