#include "common/config/params.hpp"

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
  p.align_speed = e.align_speed_rad_s();
  p.align_tolerance = e.align_tolerance_rad();
  p.blend_s = e.blend_s();
  p.session = session;
  p.expiry_ms = static_cast<std::uint32_t>(r.expiry_s() * 1e3);
  return p;
}

MotorAxis::Params motor_params(const scene::Motor& m) {
  return {.J = m.j_kgm2(),
          .viscous = m.viscous_nms_per_rad(),
          .gravity = m.gravity_nm(),
          .gravity_angle = m.gravity_angle_rad(),
          .encoder_counts_per_rev = m.encoder_counts_per_rev(),
          .stop_min = m.stop_min_rad(),
          .stop_max = m.stop_max_rad()};
}

Therapist::Params therapist_params(const scene::Therapist& t) {
  Grip grip{t.k_h_nm_per_rad(), t.b_h_nms_per_rad()};
  if (t.grip() == scene::LIGHT) grip = kLightGrip;
  if (t.grip() == scene::NORMAL) grip = kNormalGrip;
  if (t.grip() == scene::FIRM) grip = kFirmGrip;
  Therapist::Params p{.K_h = grip.K_h, .B_h = grip.B_h, .J_h = t.j_h_kgm2(), .intended = {}};
  for (const scene::Movement& m : t.intended()) {
    if (m.has_ramp_to_rad()) {
      p.intended.push_back(Movement::ramp(m.ramp_to_rad(), m.duration_s()));
    } else if (m.has_sine_amplitude_rad()) {
      p.intended.push_back(Movement::sine(m.sine_amplitude_rad(), m.sine_frequency_hz(), m.duration_s()));
    } else {
      p.intended.push_back(Movement::hold(m.duration_s()));
    }
  }
  return p;
}

Environment::Params environment_params(const scene::Slave& slave) {
  Environment::Params p;
  if (slave.has_hand()) {
    const scene::Hand& h = slave.hand();
    p.hand = {.stiffness = h.stiffness_nm_per_rad(),
              .damping = h.damping_nms_per_rad(),
              .rest = h.rest_rad(),
              .from = h.from_s(),
              .until = h.until_s()};
  }
  if (slave.has_wall()) {
    const scene::Wall& w = slave.wall();
    p.wall = {.stiffness = w.stiffness_nm_per_rad(), .damping = w.damping_nms_per_rad(), .at = w.at_rad()};
  }
  return p;
}

}  // namespace

StationParams master_station_params(const scene::Scene& scene, std::uint32_t session) {
  return station_params(scene, Role::kLeader, scene.master().axis(), session);
}

StationParams slave_station_params(const scene::Scene& scene, std::uint32_t session) {
  return station_params(scene, Role::kFollower, scene.slave().axis(), session);
}

MasterWorld::Params master_world_params(const scene::Scene& scene) {
  return {.motor = motor_params(scene.master().motor()),
          .therapist = therapist_params(scene.master().therapist()),
          .step = scene.world().step_s()};
}

DirectSlaveWorld::Params direct_slave_world_params(const scene::Scene& scene) {
  return {.motor = motor_params(scene.slave().motor()),
          .environment = environment_params(scene.slave()),
          .step = scene.world().step_s()};
}

SeriesElasticWorld::Params series_elastic_world_params(const scene::Scene& scene) {
  const scene::SeriesElastic& e = scene.slave().series_elastic();
  SeriesElasticWorld::Params p;
  p.actuator.spring = e.spring_nm_per_rad();
  p.actuator.J = e.j_joint_kgm2();
  p.actuator.viscous = e.viscous_nms_per_rad();
  p.actuator.tendon = {.F_c = e.tendon_friction_nm(), .sigma = e.tendon_stiffness_nm_per_rad()};
  p.actuator.motor_bandwidth_hz = e.motor_bandwidth_hz();
  p.actuator.motor_speed_limit = e.motor_speed_limit_rad_s();
  p.actuator.joint_counts_per_rev = e.joint_counts_per_rev();
  p.actuator.motor_counts_per_rev = e.motor_counts_per_rev();
  p.actuator.stop_min = e.stop_min_rad();
  p.actuator.stop_max = e.stop_max_rad();
  p.environment = environment_params(scene.slave());
  p.step = scene.world().step_s();
  return p;
}

OperatorTimeline::OperatorTimeline(const scene::Scene& scene) {
  for (const scene::OperatorAct& timed : scene.operator_acts()) {
    const OperatorAct act = timed.act() == scene::ENGAGE ? OperatorAct::kEngage
                            : timed.act() == scene::HOLD ? OperatorAct::kHold
                                                         : OperatorAct::kStop;
    acts_.push_back({timed.at_s(), act});
  }
}

Nanoseconds tick_of(const scene::Scene& scene) { return from_seconds(scene.tick_s()); }

}  // namespace farhand
