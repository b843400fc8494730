#include "common/config/station_params.hpp"

namespace farhand {
namespace {

DriveParams drive_params(const scene::Scene& scene, const scene::Axis& axis) {
  const scene::Control& c = scene.control();
  DriveParams p;
  p.model = {.J_n = axis.j_n_kgm2(),
             .K_tn = axis.k_tn_nm_per_a(),
             .viscous = axis.viscous_nms_per_rad(),
             .coulomb = axis.coulomb_nm(),
             .gravity = axis.gravity_nm(),
             .gravity_angle = axis.gravity_angle_rad()};
  p.K = {.K_p = c.k_p_per_s2(), .K_d = c.k_d_per_s(), .K_f = c.k_f_per_kgm2()};
  p.g_dis = Cutoff::rad_s(c.g_dis_rad_s());
  p.g_reac = Cutoff::rad_s(c.g_reac_rad_s());
  p.g_v = Cutoff::rad_s(c.g_v_rad_s());
  p.gate = {.torque = axis.torque_limit_nm(),
            .torque_rate = axis.torque_rate_limit_nm_per_s(),
            .velocity = axis.velocity_limit_rad_s(),
            .range_min = axis.range_min_rad(),
            .range_max = axis.range_max_rad()};
  p.take_over_s = scene.engagement().blend_s();
  p.dt_s = scene.tick_s();
  return p;
}

StationParams station_params(const scene::Scene& scene, Role role, const scene::Axis& axis, std::uint32_t session) {
  const scene::Control& c = scene.control();
  const scene::Engagement& e = scene.engagement();
  const scene::Receive& r = scene.receive();
  StationParams p;
  p.role = role;
  p.scene.drive = drive_params(scene, axis);
  p.scene.g_net = Cutoff::rad_s(c.g_net_rad_s());
  p.scene.local_model = c.local_model() == scene::WITH_FORCE ? LocalModel::kWithForce : LocalModel::kThesis;
  p.scene.sdcv = {.f_1 = c.f_1_nm(), .f_2 = c.f_2_nm(), .alpha_cutoff = Cutoff::rad_s(c.alpha_cutoff_rad_s())};
  p.receive.timeout = from_seconds(r.timeout_s());
  p.receive.playout_max = from_seconds(r.playout_max_s());
  p.receive.expiry = from_seconds(r.expiry_s());
  p.engagement.timeout = from_seconds(e.timeout_s());
  if (axis.has_homing()) {
    const scene::Homing& h = axis.homing();
    p.engagement.homing = true;
    p.engagement.homing_timeout = from_seconds(h.timeout_s());
    p.homing = {.stop = h.stop_rad(), .back = h.back_rad(), .speed = h.speed_rad_s(), .torque = h.torque_nm()};
  }
  p.align_speed = e.align_speed_rad_s();
  p.align_tolerance = e.align_tolerance_rad();
  p.blend_s = e.blend_s();
  p.session = session;
  p.expiry_ms = static_cast<std::uint32_t>(r.expiry_s() * 1e3);
  return p;
}

PatientLimits patient_limits(const scene::Slave& slave) {
  const scene::Limits& l = slave.limits();
  const double half = 0.5 * slave.axis().torque_limit_nm() / slave.axis().k_tn_nm_per_a();
  const double usual_a = slave.device() == scene::SERIES_ELASTIC ? 1.0 : half;
  return {.power_w = l.power_w(),
          .energy_j = l.energy_j_per_min(),
          .session_s = l.session_s(),
          .continuous_a = l.has_motor_continuous_a() ? l.motor_continuous_a() : usual_a,
          .overload = l.motor_overload(),
          .overload_s = l.motor_overload_s(),
          .surface_c = l.surface_limit_c(),
          .room_c = l.room_c(),
          .soft_start_s = l.soft_start_s(),
          .let_go_after_s = l.let_go_after_s()};
}

}  // namespace

StationParams master_station_params(const scene::Scene& scene, std::uint32_t session) {
  StationParams p = station_params(scene, Role::kLeader, scene.master().axis(), session);
  if (scene.architecture() == scene::FOUR_CHANNEL_CDOB) p.architecture = Architecture::kCdob;
  if (scene.architecture() == scene::FOUR_CHANNEL_CDOB_SDCV) p.architecture = Architecture::kCdobSdcv;
  return p;
}

StationParams slave_station_params(const scene::Scene& scene, std::uint32_t session) {
  const scene::Axis& axis = scene.slave().axis();
  StationParams p = station_params(scene, Role::kFollower, axis, session);
  p.scene.drive.gate.acceleration = axis.acceleration_limit_rad_s2();
  p.scene.drive.gate.speed = axis.velocity_limit_rad_s();
  p.guard.limits = patient_limits(scene.slave());
  return p;
}

}  // namespace farhand
