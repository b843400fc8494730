#include "common/config/world_params.hpp"

namespace farhand {
namespace {

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

}  // namespace farhand
