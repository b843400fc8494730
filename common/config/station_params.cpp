#include "common/config/station_params.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/config/scene_kind.hpp"
#include "common/config/world_params.hpp"
#include "common/device/mcu_frame.hpp"

namespace farhand {
namespace {

constexpr double kStiffestHand = 30;     // N m/rad; a finger joint has up to 10
constexpr double kStiffestGrasp = 60;    // N m/rad; a rigid thing behind the pulp of a fingertip, 10 N/mm at 80 mm
constexpr double kUntilItIsSure = 0.95;  // of the speed of a therapist, who may move himself
constexpr double kFinestCount = 1e-4;    // rad; what is finer tells nothing more of an axis that shakes by that much

// What a drive of which nobody says anything is taken to do: a tick may be a period late without being missed.
constexpr double kTicksHeld = 2, kTicksFalling = 4;

DriveParams drive_params(const scene::Scene& scene, const scene::Axis& axis, const scene::PowerStage& stage) {
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
  p.person = {.speed = axis.velocity_limit_rad_s()};
  p.power_stage = {.hold_s = stage.has_hold_s() ? stage.hold_s() : kTicksHeld * scene.tick_s(),
                   .fall_s = stage.has_fall_s() ? stage.fall_s() : kTicksFalling * scene.tick_s()};
  p.power_stage_named = stage.has_hold_s() && stage.has_fall_s();
  p.take_over_s = scene.engagement().blend_s();
  p.dt_s = scene.tick_s();
  return p;
}

Matching matching_of(scene::WaveMatching matching) {
  if (matching == scene::SLAVE_END) return Matching::kSlave;
  return matching == scene::BOTH_ENDS ? Matching::kBoth : Matching::kNone;
}

StationParams station_params(const scene::Scene& scene, Role role, const scene::Axis& axis,
                             const scene::PowerStage& stage, std::uint32_t session) {
  const scene::Control& c = scene.control();
  const scene::Engagement& e = scene.engagement();
  const scene::Receive& r = scene.receive();
  StationParams p;
  p.role = role;
  p.control.drive = drive_params(scene, axis, stage);
  p.control.law.g_net = Cutoff::rad_s(c.g_net_rad_s());
  p.control.law.local_model = c.local_model() == scene::WITH_FORCE ? LocalModel::kWithForce : LocalModel::kThesis;
  p.control.law.sdcv = {.f_1 = c.f_1_nm(),
                        .f_2 = c.f_2_nm(),
                        .alpha_cutoff = Cutoff::rad_s(c.alpha_cutoff_rad_s()),
                        .from_patient = c.sdcv_from_patient()};
  p.control.law.two_channel = {
      .K_2 = c.k_2_nm_per_rad(), .B_2 = c.b_2_nms_per_rad(), .B_slave = c.b_slave_nms_per_rad()};
  p.control.law.wave = {.b = c.wave_b_nms_per_rad(),
                        .K_s = c.wave_k_s_nm_per_rad(),
                        .B_s = c.wave_b_s_nms_per_rad(),
                        .drift = c.wave_drift_per_s(),
                        .matching = matching_of(c.wave_matching())};
  p.control.law.tank = {.level = c.tank_level_j(),
                        .alpha = c.tank_alpha_nms_per_rad_j(),
                        .rate = c.tank_rate_per_s(),
                        .B_fast = c.tank_b_fast_nms_per_rad()};
  p.architecture = scene::Architecture_Name(scene.architecture());
  p.receive.timeout = from_seconds(r.timeout_s());
  p.receive.playout_max = from_seconds(r.playout_max_s());
  p.receive.expiry = from_seconds(r.expiry_s());
  p.engagement.timeout = from_seconds(e.timeout_s());
  p.engagement.longest_gap = p.receive.brief = from_seconds(e.resume_s());
  if (axis.has_homing()) {
    const scene::Homing& h = axis.homing();
    p.engagement.homing = true;
    p.engagement.homing_timeout = from_seconds(h.timeout_s());
    p.homing = {.stop = h.stop_rad(), .back = h.back_rad(), .speed = h.speed_rad_s(), .torque = h.torque_nm()};
  }
  if (axis.has_identification()) {
    const scene::Identification& i = axis.identification();
    // 0.7 of the range: far from its ends, and far enough to reach every speed.
    const double middle = 0.5 * (axis.range_min_rad() + axis.range_max_rad());
    const double half = 0.35 * (axis.range_max_rad() - axis.range_min_rad());
    p.engagement.identification = true;
    p.identifying = {.sweeps = {.low = middle - half,
                                .high = middle + half,
                                .speed = i.speed_rad_s(),
                                .acceleration = i.acceleration_rad_s2(),
                                .rounds = static_cast<int>(i.rounds())},
                     .torque = i.torque_nm()};
  }
  p.intake = {.torque = axis.torque_limit_nm(),
              .velocity = axis.velocity_limit_rad_s(),
              .range_min = axis.range_min_rad(),
              .range_max = axis.range_max_rad()};
  if (scene.architecture() == scene::WAVE) {
    const double b = p.control.law.wave.b;
    p.intake.wave = (b * p.intake.velocity + p.intake.torque) / std::sqrt(2 * b);
  }
  p.align_speed = e.align_speed_rad_s();
  p.align_tolerance = e.align_tolerance_rad();
  p.blend_s = e.blend_s();
  p.session = session;
  p.expiry_ms = static_cast<std::uint32_t>(r.expiry_s() * 1e3);
  return p;
}

double count_rad(double per_rev) { return per_rev > 0 ? 2 * std::numbers::pi / per_rev : 0.0; }

double count_rad(const scene::Scene& scene) {
  const scene::Slave& slave = scene.slave();
  const bool elastic = slave.device() == scene::SERIES_ELASTIC;
  const double per_rev =
      elastic ? slave.series_elastic().joint_counts_per_rev() : slave.motor().encoder_counts_per_rev();
  const double count = count_rad(per_rev);
  return elastic ? std::max(count, 1.0 / mcu::kAngleCountsPerRad) : count;
}

// What is known of a device and of the person in it, who may be twice as stiff as said.
struct Known {
  double stop_min, stop_max;  // rad
  double count;               // rad
  double J;                   // kg m2, with what moves along
  double person_stiffness, person_damping;
  double dry_friction;  // N m, of the device
};

PlausibilityParams plausibility_params(const Known& known, const DriveParams& drive) {
  PlausibilityParams p;
  p.dt_s = drive.dt_s;
  p.stop_min = known.stop_min;
  p.stop_max = known.stop_max;
  p.resolution = std::max(known.count, kFinestCount);
  // The motor and a person who is as strong, twice, because the inertia may be less than believed.
  p.top_acceleration = 4 * drive.gate.torque / drive.model.J_n;
  p.g_reac = drive.g_reac;
  p.settle_s = 10 / drive.g_v.rad_s();
  // A loop with a higher J_n/J is not stable.
  p.least_inertia = drive.model.J_n / 1.3;
  p.hand_stiffness = std::max(kStiffestHand, 2 * known.person_stiffness);
  p.inertia = 2 * std::max(drive.model.J_n, known.J);
  // The loop itself holds the axis like a spring of K_p/K_f; without a force gain nothing moves it for good.
  p.stiffness = std::max({kStiffestGrasp, p.hand_stiffness, 2 * drive.K.K_p / std::max(drive.K.K_f, 1e-9)});
  p.damping = 2 * known.person_damping;
  p.friction = 2 * std::max(drive.model.coulomb, known.dry_friction) + 0.01 * drive.gate.torque;
  return p;
}

PlausibilityParams plausibility_of_slave(const scene::Scene& scene, const DriveParams& drive) {
  const scene::Slave& slave = scene.slave();
  const scene::Motor& motor = slave.motor();
  const scene::SeriesElastic& elastic = slave.series_elastic();
  const double stiffness = std::max(slave.hand().stiffness_nm_per_rad(), slave.wall().stiffness_nm_per_rad());
  const double damping = std::max(slave.hand().damping_nms_per_rad(), slave.wall().damping_nms_per_rad());
  if (slave.device() != scene::SERIES_ELASTIC) {
    const double dry = std::max(motor.coulomb_nm(), motor.has_lugre() ? motor.lugre().f_s_nm() : 0.0);
    return plausibility_params(
        {motor.stop_min_rad(), motor.stop_max_rad(), count_rad(scene), motor.j_kgm2(), stiffness, damping, dry}, drive);
  }
  const double dry =
      std::max(elastic.tendon_friction_nm(), elastic.has_tendon_lugre() ? elastic.tendon_lugre().f_s_nm() : 0.0);
  PlausibilityParams p = plausibility_params({elastic.stop_min_rad(), elastic.stop_max_rad(), count_rad(scene),
                                              elastic.j_joint_kgm2(), stiffness, damping, dry},
                                             drive);
  p.g_reac = Cutoff::rad_s(slave.mcu().g_rad_s());
  p.settle_s = 10 / slave.mcu().g_v_rad_s();
  p.unseen_nm_per_s = 2 * elastic.spring_nm_per_rad() * elastic.motor_speed_limit_rad_s();
  return p;
}

PlausibilityParams plausibility_of_master(const scene::Scene& scene, const DriveParams& drive) {
  const scene::Motor& motor = scene.master().motor();
  const auto arm = master_world_params(scene).load;
  const double dry = std::max(motor.coulomb_nm(), motor.has_lugre() ? motor.lugre().f_s_nm() : 0.0);
  return plausibility_params({motor.stop_min_rad(), motor.stop_max_rad(), count_rad(motor.encoder_counts_per_rev()),
                              motor.j_kgm2() + arm.J_h, arm.K_h, arm.B_h, dry},
                             drive);
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
  StationParams p = station_params(scene, Role::kLeader, scene.master().axis(), scene.master().power_stage(), session);
  p.scale = scale_of(scene);
  p.control.drive.K.K_f = master_K_f(scene);
  p.control.law.sdcv.f_1 *= p.scale.force;
  p.control.law.sdcv.f_2 *= p.scale.force;
  p.identifying.resolution = count_rad(scene.master().motor().encoder_counts_per_rev());
  p.control.drive.person.power = scene.master().limits().power_w();
  p.control.drive.person.speed *= kUntilItIsSure;
  p.control.drive.person.free = true;
  p.guard.plausibility = plausibility_of_master(scene, p.control.drive);
  p.control.drive.resolution = p.guard.plausibility.resolution;
  p.control.drive.stiffest_nm_per_rad = p.guard.plausibility.hand_stiffness;
  p.guard.oscillation = {.limit = scene.master().limits().shaking_limit_rad_s(),
                         .resolution = p.identifying.resolution,
                         .dt_s = scene.tick_s()};
  return p;
}

StationParams slave_station_params(const scene::Scene& scene, std::uint32_t session) {
  const scene::Axis& axis = scene.slave().axis();
  StationParams p = station_params(scene, Role::kFollower, axis, scene.slave().power_stage(), session);
  p.control.drive.gate.acceleration = axis.acceleration_limit_rad_s2();
  p.control.drive.person.power = scene.slave().limits().power_w();
  p.control.law.tank.alpha = p.control.law.tank.B_fast =
      0.0;  // what the therapist does not feel does not tell him either
  p.identifying.resolution = count_rad(scene.slave().motor().encoder_counts_per_rev());
  // A margin at both ends of the range, where references are cut.
  const double width = axis.range_max_rad() - axis.range_min_rad(), margin = std::min(0.035, 0.1 * width);
  p.engagement.sweep = scene.control().k_p_per_s2() > 0.0;
  p.sweeping.low = axis.range_min_rad() + margin;
  p.sweeping.high = axis.range_max_rad() - margin;
  p.guard.limits = patient_limits(scene.slave());
  p.guard.plausibility = plausibility_of_slave(scene, p.control.drive);
  p.control.drive.resolution = p.guard.plausibility.resolution;
  p.control.drive.stiffest_nm_per_rad = p.guard.plausibility.hand_stiffness;
  p.guard.oscillation = {
      .limit = scene.slave().shaking_limit_rad_s(), .resolution = count_rad(scene), .dt_s = scene.tick_s()};
  return p;
}

}  // namespace farhand
