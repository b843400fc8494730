// Writes the constants of the firmware: the parameters of the core, worked out from SI on the PC, where there are
// doubles and where what does not fit is refused.
#include <cstddef>
#include <cstdio>

#include "slave/mcu/avr/board_settings.hpp"

namespace farhand::mcu {
namespace {

void print(const Gain& g) { std::printf("    {%u, %u},\n", g.mantissa, g.right); }
void print(const EncoderUnit& e) {
  std::printf("    {%ld, %u, %ld, %ld},\n", long{e.whole}, e.fraction, long{e.most_counts}, long{e.jump});
}
void print(std::int32_t value) { std::printf("    %ld,\n", long{value}); }
void print(std::uint16_t value) { std::printf("    %u,\n", value); }
template <std::size_t kCount>
void print(const std::int32_t (&table)[kCount]) {
  std::printf("    {\n");
  for (const std::int32_t value : table) print(value);
  std::printf("    },\n");
}
template <class... Values>
void print_all(const Values&... values) {
  (print(values), ...);
}

void print_constants() {
  const McuSettings settings = board_settings();
  const McuParams p = make_mcu_params(settings);
  std::printf(
      "// Made by slave/mcu/avr/make_constants.cpp.\n#pragma once\n\n#include \"slave/mcu/orthosis_mcu.hpp\"\n\n");
  std::printf("namespace farhand {\nnamespace mcu {\n\nconstexpr McuParams kParams = {\n");
  // In the order of McuParams; the compiler of the firmware misses what is missing, the test in simavr what is swapped.
  print_all(p.joint, p.motor, p.spring, p.velocity_filter, p.per_second, p.most_ahead, p.observer_filter, p.inertia,
            p.viscous, p.K_p, p.K_d, p.K_f, p.spring_gain, p.per_loop, p.angle_telemetry, p.torque_telemetry,
            p.torque_limit, p.torque_step, p.spring_fault, p.sensor_unit, p.sensor_apart, p.motor_speed_limit, p.x_step,
            p.v_step, p.f_step, p.x_min, p.x_max, p.v_limit, p.k_B, p.k_E, p.allowed_speed, p.most_given_ahead,
            p.per_ramp_loop, p.per_stop_loop, p.allowed_step, p.watchdog_loops, p.ramp_loops, p.loops_per_frame,
            p.overrun_limit, p.stop_loops, p.release_loops, p.sensor_loops);
  const Gain duty = duty_per_velocity(settings);
  std::printf("};\nconstexpr Gain kDutyPerVelocity = {%u, %u};\n\n", duty.mantissa, duty.right);
  std::printf("}  // namespace mcu\n}  // namespace farhand\n");
}

}  // namespace
}  // namespace farhand::mcu

int main() {
  farhand::mcu::print_constants();
  return 0;
}
