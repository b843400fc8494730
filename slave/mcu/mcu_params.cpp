#include "slave/mcu/mcu_params.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>
#include <stdexcept>

namespace farhand::mcu {
namespace {

constexpr double kAngleUnits = 1 << kAngleBits;
constexpr double kVelocityUnits = 1 << kVelocityBits;
constexpr double kTorqueUnits = 1 << kTorqueBits;
// The bound at the hand (orthosis_mcu.hpp): found by tests/mcu_rogue_test.cpp as the fastest that keeps its lines with
// the loops of the default scene.
constexpr double kEndRate = 18;                            // 1/s, towards an end of the range
constexpr double kSpeedShare = 1.25, kTorqueShare = 1.07;  // near the torque limit
constexpr double kUnknownTorque = 0.1;                     // N m, besides what is known to resist

// 1/s. A faster motor winds the spring faster, and a stiff hand swings further on it: 36 up to 4 rad/s, 33 at 8;
// beyond that nobody measured.
double bound_rate(double motor_speed_limit) {
  return std::fmin(std::fmax(36 - 0.75 * (motor_speed_limit - 4), 30), 36);
}

// N m, given ahead of what resists more and more. A faster motor winds a hand of 5 N m/rad over its power with it: 0.4
// up to 4 rad/s, 0.2 at 8; beyond that nobody measured.
double most_given_ahead(double motor_speed_limit) {
  return std::fmin(std::fmax(0.4 - 0.05 * (motor_speed_limit - 4), 0.0), 0.4);
}

// NaN is outside every range.
double within(const char* name, double value, double lowest, double highest) {
  if (value >= lowest && value <= highest) return value;
  std::ostringstream message;
  message << "MCU: " << name << " = " << value << " does not fit; allowed is " << lowest << " to " << highest;
  throw std::invalid_argument(message.str());
}

std::int32_t rounded(double units) { return static_cast<std::int32_t>(std::lround(units)); }

std::uint16_t loops(const char* name, double time_s, double loop_hz) {
  return static_cast<std::uint16_t>(std::lround(within(name, time_s, 1.0 / loop_hz, 65000.0 / loop_hz) * loop_hz));
}

EncoderUnit make_encoder(const char* name, double counts_per_rev, double jump_rad) {
  if (counts_per_rev != 0.0) within(name, counts_per_rev, 100, 4e8);
  const double unit = encoder_unit_rad(counts_per_rev) * kAngleUnits;
  EncoderUnit encoder{};
  // In 2^-16 units first, so that a fraction that rounds up carries into the whole.
  const auto scaled = static_cast<std::int64_t>(std::llround(unit * 65536.0));
  encoder.whole = static_cast<std::int32_t>(scaled >> 16);
  encoder.fraction = static_cast<std::uint16_t>(scaled & 0xFFFF);
  encoder.most_counts = static_cast<std::int32_t>((kLargest - 1) / unit) - 1;
  encoder.jump = rounded(jump_rad * kAngleUnits);
  return encoder;
}

}  // namespace

double encoder_unit_rad(double counts_per_rev) {
  return counts_per_rev > 0 ? 2.0 * std::numbers::pi / counts_per_rev : 1.0 / kAngleUnits;
}

Gain make_gain(const char* name, double value) {
  within(name, value, 0, 65535);
  int exponent = 0;
  long mantissa = std::lround(std::frexp(value, &exponent) * 65536.0);
  if (mantissa == 65536) mantissa = 32768, ++exponent;
  if (value == 0 || exponent < -31) return Gain{0, 16};
  return Gain{static_cast<std::uint16_t>(mantissa), static_cast<std::uint8_t>(16 - exponent)};
}

McuParams make_mcu_params(const McuSettings& s) {
  within("loop_hz", s.loop_hz, 1000, 20000);
  const double loops_per_frame = s.loop_hz / 1000.0;
  if (loops_per_frame != std::floor(loops_per_frame)) {
    throw std::invalid_argument("MCU: loop_hz must be a multiple of 1000 Hz, the rate of the serial frames");
  }
  const double dt = 1.0 / s.loop_hz;
  // Below loop_hz / 4096 the low-pass stops moving half a unit / a = 0.1 mN m before its input: a count of the
  // telemetry.
  within("g", s.g, s.loop_hz / 4096, 1e4);
  within("g_v", s.g_v, s.loop_hz / 4096, 1e4);
  within("J_n", s.J_n, 1e-9, 10);
  within("range_min", s.range_min, -1, 1);
  within("range_max", s.range_max, s.range_min, 1);
  const double a = s.g * dt / (1.0 + s.g * dt), a_v = s.g_v * dt / (1.0 + s.g_v * dt);
  constexpr double kTorquePerAngle = kTorqueUnits / kAngleUnits, kTorquePerVelocity = kTorqueUnits / kVelocityUnits;

  McuParams p{};
  const double jump = within("encoder_speed_fault", s.encoder_speed_fault, 1e-3, 4 * s.loop_hz) * dt;
  p.joint = make_encoder("joint_counts_per_rev", s.joint_counts_per_rev, jump);
  p.motor = make_encoder("motor_counts_per_rev", s.motor_counts_per_rev, jump);
  p.spring = make_gain("spring", s.spring * kTorquePerAngle);
  p.velocity_filter = make_gain("g_v", a_v);
  p.per_second = make_gain("g_v", a_v / dt * kVelocityUnits / kAngleUnits);
  p.most_ahead = rounded(std::fmin(kFastest * s.velocity_limit * dt / a_v, 4) * kAngleUnits);
  p.observer_filter = make_gain("g", a);
  p.inertia = make_gain("J_n g", s.J_n * s.g * kTorquePerVelocity);
  p.viscous = make_gain("viscous", s.viscous * kTorquePerVelocity);
  p.K_p = make_gain("J_n K_p", s.J_n * s.K_p * kTorquePerAngle);
  p.K_d = make_gain("J_n K_d", s.J_n * s.K_d * kTorquePerVelocity);
  p.K_f = make_gain("J_n K_f", s.J_n * s.K_f);
  p.spring_gain = make_gain("spring_gain", s.spring_gain * kVelocityUnits / kTorqueUnits);
  p.per_loop = make_gain("dt", dt * kAngleUnits / kVelocityUnits);
  p.angle_telemetry = make_gain("angle", kAngleCountsPerRad / kAngleUnits);
  p.torque_telemetry = make_gain("torque", kTorqueCountsPerNm / kTorqueUnits);

  p.torque_limit = rounded(within("torque_limit", s.torque_limit, 1e-3, 8) * kTorqueUnits);
  p.torque_step =
      rounded(std::fmin(within("torque_rate_limit", s.torque_rate_limit, 1e-2, 1e9) * dt, 16) * kTorqueUnits);
  p.spring_fault = rounded(within("spring_torque_fault", s.spring_torque_fault, s.torque_limit, 15.9) * kTorqueUnits);
  p.motor_speed_limit = rounded(within("motor_speed_limit", s.motor_speed_limit, 1e-3, 200) * kVelocityUnits);
  constexpr double kFrame = 1e-3;
  p.x_step = rounded(within("velocity_limit", s.velocity_limit, 1e-3, 1000) * kFrame * kAngleUnits);
  p.v_step = rounded(within("acceleration_limit", s.acceleration_limit, 1e-2, 1e4) * kFrame * kVelocityUnits);
  p.f_step = rounded(within("force_rate_limit", s.force_rate_limit, 1e-2, 4e3) * kFrame * kTorqueUnits);
  p.v_limit = rounded(std::fmin(s.velocity_limit * kVelocityUnits, kLargest));
  const double J_k_B = s.J_n * bound_rate(s.motor_speed_limit);
  p.k_B = make_gain("J_n k_B", J_k_B * kTorquePerVelocity);
  p.k_E = make_gain("J_n k_E", 2 * J_k_B * kEndRate * kTorquePerAngle);
  p.most_given_ahead = rounded(most_given_ahead(s.motor_speed_limit) * kTorqueUnits);
  within("power_limit", s.power_limit, 1e-3, 1e4);
  for (int step = 0; step < kResistanceSteps; ++step) {
    const double resisting = (step + 0.5) * (1 << kResistanceShift) / kTorqueUnits;
    const double by_power = s.power_limit / (resisting + kUnknownTorque);
    const double by_torque = kSpeedShare * s.velocity_limit * std::fmax(kTorqueShare - resisting / s.torque_limit, 0.0);
    const double v_allow = std::fmin(s.velocity_limit, std::fmin(by_power, by_torque));
    p.allowed_speed[step] = rounded(std::fmin(J_k_B * v_allow, 16) * kTorqueUnits);
  }
  p.x_min = rounded(s.range_min * kAngleUnits);
  p.x_max = rounded(s.range_max * kAngleUnits);
  p.watchdog_loops = loops("watchdog_s", s.watchdog_s, s.loop_hz);
  p.ramp_loops = loops("ramp_s", s.ramp_s, s.loop_hz);
  p.overrun_limit = loops("overrun_fault_s", s.overrun_fault_s, s.loop_hz);
  p.stop_loops = loops("stop_ramp_s", s.stop_ramp_s, s.loop_hz);
  p.per_ramp_loop = make_gain("ramp_s", 1.0 / p.ramp_loops);
  p.per_stop_loop = make_gain("stop_ramp_s", 1.0 / p.stop_loops);
  p.allowed_step = p.torque_limit / p.ramp_loops + 1;
  p.release_loops = loops("release_s", s.release_s, s.loop_hz);
  p.sensor_loops = loops("spring_sensor_fault_s", s.spring_sensor_fault_s, s.loop_hz);
  p.sensor_unit = rounded(within("spring_sensor_nm", s.spring_sensor_nm, 0, 15) / kSensorCounts * kTorqueUnits);
  if (s.spring_sensor_nm > 0) {
    within("spring_sensor_fault_nm", s.spring_sensor_fault_nm, 1e-3, 15);
    // Two counts of each encoder say nothing yet; a stiff spring makes much of them.
    const double counts_nm =
        2 * s.spring * (encoder_unit_rad(s.joint_counts_per_rev) + encoder_unit_rad(s.motor_counts_per_rev));
    p.sensor_apart = rounded(std::fmin(std::fmax(s.spring_sensor_fault_nm, counts_nm), 15) * kTorqueUnits);
  }
  p.loops_per_frame = static_cast<std::uint16_t>(loops_per_frame);
  return p;
}

}  // namespace farhand::mcu
