#include "slave/emulator_params.hpp"

#include <stdexcept>
#include <string>

#include "common/config/world_params.hpp"

namespace farhand {
namespace {

// What make_mcu_params calls it, and the field of the scene that it comes from.
constexpr struct {
  const char *of_mcu, *of_scene;
} kNames[] = {{"loop_hz", "slave.mcu.loop_hz"},
              {"spring", "slave.series_elastic.spring_nm_per_rad"},
              {"joint_counts_per_rev", "slave.series_elastic.joint_counts_per_rev"},
              {"motor_counts_per_rev", "slave.series_elastic.motor_counts_per_rev"},
              {"J_n", "slave.axis.j_n_kgm2"},
              {"viscous", "slave.axis.viscous_nms_per_rad"},
              {"J_n K_p", "control.k_p_per_s2"},
              {"J_n K_d", "control.k_d_per_s"},
              {"J_n K_f", "control.k_f_per_kgm2"},
              {"g", "slave.mcu.g_rad_s"},
              {"J_n g", "slave.mcu.g_rad_s"},
              {"g_v", "slave.mcu.g_v_rad_s"},
              {"spring_gain", "slave.mcu.spring_gain_per_s"},
              {"power_limit", "slave.limits.power_w"},
              {"torque_limit", "slave.axis.torque_limit_nm"},
              {"torque_rate_limit", "slave.axis.torque_rate_limit_nm_per_s"},
              {"spring_torque_fault", "slave.axis.torque_limit_nm"},
              {"motor_speed_limit", "slave.series_elastic.motor_speed_limit_rad_s"},
              {"range_min", "slave.axis.range_min_rad"},
              {"range_max", "slave.axis.range_max_rad"},
              {"velocity_limit", "slave.axis.velocity_limit_rad_s"}};

// "MCU: name ..." by the field.
std::string by_field(const std::string& sentence) {
  constexpr std::size_t kBegin = 5;
  const std::string name = sentence.substr(kBegin, sentence.find(" =") - kBegin);
  for (const auto& one : kNames) {
    if (name == one.of_mcu || sentence.starts_with(std::string("MCU: ") + one.of_mcu + " must"))
      return std::string(one.of_scene) + " does not fit the MCU: " + sentence.substr(kBegin);
  }
  return sentence;
}

}  // namespace

OrthosisEmulator::Params emulator_params(const scene::Scene& scene) {
  const scene::Axis& axis = scene.slave().axis();
  const scene::SeriesElastic& elastic = scene.slave().series_elastic();
  const scene::McuControl& loops = scene.slave().mcu();
  OrthosisEmulator::Params p;
  p.world = series_elastic_world_params(scene);
  p.numerics = world_numerics(scene);
  p.mcu.loop_hz = loops.loop_hz();
  p.mcu.spring = elastic.spring_nm_per_rad();
  p.mcu.joint_counts_per_rev = elastic.joint_counts_per_rev();
  p.mcu.motor_counts_per_rev = elastic.motor_counts_per_rev();
  p.mcu.J_n = axis.j_n_kgm2();
  p.mcu.viscous = axis.viscous_nms_per_rad();
  p.mcu.K_p = scene.control().k_p_per_s2();
  p.mcu.K_d = scene.control().k_d_per_s();
  p.mcu.K_f = scene.control().k_f_per_kgm2();
  p.mcu.g = loops.g_rad_s();
  p.mcu.g_v = loops.g_v_rad_s();
  p.mcu.spring_gain = loops.spring_gain_per_s();
  p.mcu.power_limit = scene.slave().limits().power_w();
  p.mcu.torque_limit = axis.torque_limit_nm();
  p.mcu.torque_rate_limit = axis.torque_rate_limit_nm_per_s();
  p.mcu.motor_speed_limit = elastic.motor_speed_limit_rad_s();
  p.mcu.range_min = axis.range_min_rad();
  p.mcu.range_max = axis.range_max_rad();
  p.mcu.spring_sensor_nm = 8;  // as the firmware's board has it
  p.mcu.velocity_limit = axis.velocity_limit_rad_s();
  try {
    mcu::make_mcu_params(p.mcu);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(by_field(error.what()));
  }
  return p;
}

}  // namespace farhand
