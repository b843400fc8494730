// Computes the parameters of the MCU core from SI. Runs on the PC, before any loop, and refuses values that do not fit
// the scaled integers.
#pragma once

#include <cstdint>

#include "slave/mcu/orthosis_mcu.hpp"

namespace farhand::mcu {

// At the joint. Only for simulated motors, whose current the MCU shows but does not use.
constexpr double kMotorTorqueNmPerA = 1.5;

// Largest speed of the joint that the encoder is believed, in velocity_limit. A hand that springs back is faster, which
// the spring's torque shows.
constexpr double kFastest = 1.1;

struct McuSettings {
  double loop_hz = 2000;
  double spring = 10;                   // N m/rad
  double joint_counts_per_rev = 20000;  // 0: ideal
  double motor_counts_per_rev = 20000;  // seen at the joint; 0: ideal
  double J_n = 4e-3;
  double viscous = 0.002;
  double K_p = 400, K_d = 40, K_f = 125;
  double g = 100;    // rad/s, both observers
  double g_v = 500;  // rad/s
  double spring_gain = 10;
  double torque_limit = 3;
  double torque_rate_limit = 3000;
  double motor_speed_limit = 4;
  double range_min = -0.349, range_max = 0.349;  // of x_ref
  // The gate of the references. One wrong frame moves them by the step of one millisecond: 4 mrad, 0.4 rad/s, 0.3 N m.
  // The force rate is above that of an RTOB of 200 rad/s after a step of 1 N m, and the acceleration above that of four
  // counts of a 20000-count encoder.
  double velocity_limit = 4;  // of the joint too
  double acceleration_limit = 400;
  double force_rate_limit = 300;
  double power_limit = 2;  // W, at the hand
  // Faults.
  double spring_torque_fault = 6;
  double encoder_speed_fault = 150;  // rad/s between two readings: a reading that stood for 5 ms may come back
  double overrun_fault_s = 0.01;     // every loop late for this long
  double watchdog_s = 0.02;
  double ramp_s = 0.05;
  // The patient's stop: 3 N m in 2 ms is within the rate limit of the torque. A key held for 0.1 s is not a glitch.
  double stop_ramp_s = 0.002;
  double release_s = 0.1;
  // Range of the spring's own torque sensor, 10 bits over +- this, N m; 0: no sensor. With 8 N m a count is 16 mN m,
  // and a delay of one loop at 4 rad/s is 20 mN m: a difference of 0.5 N m is not noise.
  double spring_sensor_nm = 0;
  double spring_sensor_fault_nm = 0.5;
  double spring_sensor_fault_s = 0.02;
};

// Throws std::invalid_argument with one sentence: which value, and what would fit.
McuParams make_mcu_params(const McuSettings& settings);

// Nearest gain with 16 significant bits; below 2^-32 it is 0. Throws above 65535.
Gain make_gain(const char* name, double value);

// Angle of one encoder count; an ideal encoder counts in units of the core.
double encoder_unit_rad(double counts_per_rev);

inline double to_rad(std::int32_t angle) noexcept { return angle / double{1 << kAngleBits}; }
inline double to_rad_s(std::int32_t velocity) noexcept { return velocity / double{1 << kVelocityBits}; }
inline double to_nm(std::int32_t torque) noexcept { return torque / double{1 << kTorqueBits}; }

}  // namespace farhand::mcu
