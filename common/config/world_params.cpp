#include "common/config/world_params.hpp"

namespace farhand {
namespace {

Bristle::Params bristle_params(const scene::LuGre& l) {
  return {.F_c = l.f_c_nm(),
          .F_s = l.f_s_nm(),
          .v_s = l.v_s_rad_s(),
          .sigma_0 = l.sigma_0_nm_per_rad(),
          .sigma_1 = l.sigma_1_nms_per_rad(),
          .sigma_2 = l.sigma_2_nms_per_rad()};
}

MotorAxis::Params motor_params(const scene::Motor& m) {
  return {.J = m.j_kgm2(),
          .viscous = m.viscous_nms_per_rad(),
          .gravity = m.gravity_nm(),
          .gravity_angle = m.gravity_angle_rad(),
          .encoder_counts_per_rev = m.encoder_counts_per_rev(),
          .stop_min = m.stop_min_rad(),
          .stop_max = m.stop_max_rad(),
          .coulomb = m.coulomb_nm(),
          .bristle = m.has_lugre() ? std::optional(bristle_params(m.lugre())) : std::nullopt};
}

Therapist::Params therapist_params(const scene::Therapist& t, double tick_s) {
  Grip grip{t.k_h_nm_per_rad(), t.b_h_nms_per_rad()};
  if (t.grip() == scene::LIGHT) grip = kLightGrip;
  if (t.grip() == scene::NORMAL) grip = kNormalGrip;
  if (t.grip() == scene::FIRM) grip = kFirmGrip;
  Therapist::Params p{.K_h = grip.K_h, .B_h = grip.B_h, .J_h = t.j_h_kgm2(), .intended = {}, .reaction = {}};
  if (t.has_reaction()) {
    const scene::Reaction& r = t.reaction();
    p.reaction = {.above = r.above_nm(), .after = r.after_s(), .speed = r.speed_rad_s(), .tick = tick_s};
  }
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
              .until = h.until_s(),
              .spastic = h.spastic_nms_per_rad(),
              .spastic_above = h.spastic_above_rad_s(),
              .rest_amplitude = h.rest_amplitude_rad(),
              .rest_frequency = h.rest_frequency_hz(),
              .relaxed = h.has_relaxed_nm_per_rad() ? std::optional(h.relaxed_nm_per_rad()) : std::nullopt,
              .relax_time = h.relax_time_s(),
              .tremor = h.tremor_nm(),
              .tremor_frequency = h.tremor_hz()};
  }
  if (slave.has_wall()) {
    const scene::Wall& w = slave.wall();
    p.wall = {.stiffness = w.stiffness_nm_per_rad(), .damping = w.damping_nms_per_rad(), .at = w.at_rad()};
  }
  return p;
}

Method method_of(scene::Method method) {
  switch (method) {
    case scene::SEMI_IMPLICIT_EULER:
      return Method::kSemiImplicitEuler;
    case scene::RK4:
      return Method::kRk4;
    case scene::SDIRK2:
      return Method::kSdirk2;
    case scene::ROSENBROCK:
      return Method::kRosenbrock;
    case scene::ADAPTIVE:
      return Method::kAdaptive;
    case scene::CLOSED_FORM:
      return Method::kClosedForm;
    default:
      return Method::kAuto;
  }
}

}  // namespace

MasterWorld::Params master_world_params(const scene::Scene& scene) {
  return {.motor = motor_params(scene.master().motor()),
          .load = therapist_params(scene.master().therapist(), scene.tick_s())};
}

DirectSlaveWorld::Params direct_slave_world_params(const scene::Scene& scene) {
  return {.motor = motor_params(scene.slave().motor()), .load = environment_params(scene.slave())};
}

SeriesElasticWorld::Params series_elastic_world_params(const scene::Scene& scene) {
  const scene::SeriesElastic& e = scene.slave().series_elastic();
  SeriesElasticWorld::Params p;
  p.actuator.spring = e.spring_nm_per_rad();
  p.actuator.spring_range = e.spring_range_rad();
  p.actuator.J = e.j_joint_kgm2();
  p.actuator.viscous = e.viscous_nms_per_rad();
  if (e.tendon_friction_nm() > 0)
    p.actuator.tendon = Bristle::dahl(e.tendon_friction_nm(), e.tendon_stiffness_nm_per_rad());
  if (e.has_tendon_lugre()) p.actuator.tendon = bristle_params(e.tendon_lugre());
  p.actuator.motor_bandwidth_hz = e.motor_bandwidth_hz();
  p.actuator.motor_speed_limit = e.motor_speed_limit_rad_s();
  p.actuator.joint_counts_per_rev = e.joint_counts_per_rev();
  p.actuator.motor_counts_per_rev = e.motor_counts_per_rev();
  p.actuator.stop_min = e.stop_min_rad();
  p.actuator.stop_max = e.stop_max_rad();
  p.environment = environment_params(scene.slave());
  return p;
}

WorldNumerics world_numerics(const scene::Scene& scene) {
  const scene::World& world = scene.world();
  WorldNumerics numerics;
  numerics.method = method_of(world.method());
  numerics.settings.max_step = world.step_s();
  numerics.settings.rtol = world.rtol();
  numerics.settings.atol = world.atol();
  return numerics;
}

}  // namespace farhand
