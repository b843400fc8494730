// The orthosis for which the firmware is built, in SI. Runs on the PC.
#pragma once

#include "slave/mcu/avr/board.hpp"
#include "slave/mcu/mcu_params.hpp"

namespace farhand::mcu {

inline McuSettings board_settings() {
  McuSettings settings;  // as the scenes have it
  settings.loop_hz = 2000;
  settings.spring_sensor_nm = 8;
  return settings;
}

// The rated speed of the drive is the limit of the motor's speed.
inline Gain duty_per_velocity(const McuSettings& settings) {
  return make_gain("duty", kPwmTop / (settings.motor_speed_limit * (1 << kVelocityBits)));
}

}  // namespace farhand::mcu
