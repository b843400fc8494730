#include "slave/emulator_params.hpp"

#include "common/config/world_params.hpp"

namespace farhand {

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
  return p;
}

}  // namespace farhand
