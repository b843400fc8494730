#include "common/advice/scene_loops.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/config/scene_kind.hpp"
#include "common/config/schema.hpp"
#include "common/config/world_params.hpp"
#include "common/plant/intended_motion.hpp"

namespace farhand {
namespace {

SideLoop side_loop(const scene::Scene& scene, const scene::Axis& believed, const LoadedAxis& axis) {
  const scene::Control& c = scene.control();
  return {.axis = axis,
          .dt = scene.tick_s(),
          .J_n = believed.j_n_kgm2(),
          .viscous = believed.viscous_nms_per_rad(),
          .K_p = c.k_p_per_s2(),
          .K_d = c.k_d_per_s(),
          .K_f = c.k_f_per_kgm2(),
          .g_dis = c.g_dis_rad_s(),
          .g_reac = c.g_reac_rad_s(),
          .g_v = c.g_v_rad_s()};
}

// Furthest from rest that the therapist means to be while the contact is there.
double reach(const scene::Scene& scene, const Contact& contact) {
  constexpr double kEvery = 0.01;  // s
  const IntendedMotion motion(master_world_params(scene).load.intended, 0.0);
  double furthest = 0.0;
  const double until = std::min({contact.until_s, scene.duration_s(), motion.end() + kEvery});
  const auto look = [&](double t) {
    const double away = motion.at(t).x - contact.rest / scale_of(scene).position;
    if (contact.one_sided && away * (contact.rest < 0 ? -1.0 : 1.0) < 0) return;
    furthest = std::max(furthest, std::abs(away));
  };
  for (double t = contact.from_s; t < until; t += kEvery) look(t);
  look(std::min(contact.until_s, scene.duration_s()));
  return furthest;
}

}  // namespace

bool names_thresholds(const scene::Scene& scene, const Contact& contact) {
  return has_sdcv(scene) && scene.control().sdcv_from_patient() && !contact.one_sided;
}
bool joined_by_four_channels(const scene::Scene& scene) {
  return scene.architecture() == scene::FOUR_CHANNEL || has_cdob(scene);
}

std::vector<Contact> contacts(const scene::Scene& scene) {
  std::vector<Contact> all{{"free motion"}};
  Contact hand;
  if (scene.slave().has_hand()) {
    const scene::Hand& h = scene.slave().hand();
    hand = {"contact with slave.hand.stiffness_nm_per_rad = " + shortest(h.stiffness_nm_per_rad()),
            h.stiffness_nm_per_rad(),
            h.damping_nms_per_rad(),
            h.rest_rad(),
            h.from_s(),
            h.until_s()};
    if (h.from_s() < scene.duration_s()) all.push_back(hand);
  }
  if (scene.slave().has_wall()) {
    const scene::Wall& w = scene.slave().wall();
    all.push_back({"contact with slave.wall.stiffness_nm_per_rad = " + shortest(w.stiffness_nm_per_rad()),
                   w.stiffness_nm_per_rad(), w.damping_nms_per_rad(), w.at_rad(), 0.0, scene.duration_s(), true});
  }
  return all;
}

SideLoop master_loop(const scene::Scene& scene) {
  const MasterWorld::Params p = master_world_params(scene);
  SideLoop loop =
      side_loop(scene, scene.master().axis(), {p.motor.J + p.load.J_h, p.motor.viscous + p.load.B_h, p.load.K_h});
  loop.K_f = master_K_f(scene);
  return loop;
}

SideLoop direct_slave_loop(const scene::Scene& scene, const Contact& contact) {
  const scene::Motor& m = scene.slave().motor();
  return side_loop(scene, scene.slave().axis(), {m.j_kgm2(), m.viscous_nms_per_rad() + contact.b, contact.k});
}

OrthosisLoop orthosis_loop(const scene::Scene& scene, const Contact& contact) {
  const scene::SeriesElastic& e = scene.slave().series_elastic();
  const scene::McuControl& mcu = scene.slave().mcu();
  const scene::Axis& believed = scene.slave().axis();
  return {.axis = {e.j_joint_kgm2(), e.viscous_nms_per_rad() + contact.b, contact.k},
          .spring = e.spring_nm_per_rad(),
          .motor_rate = 2.0 * std::numbers::pi * e.motor_bandwidth_hz(),
          .dt = 1.0 / mcu.loop_hz(),
          .spring_gain = mcu.spring_gain_per_s(),
          .J_n = believed.j_n_kgm2(),
          .viscous = believed.viscous_nms_per_rad(),
          .K_p = scene.control().k_p_per_s2(),
          .K_d = scene.control().k_d_per_s(),
          .K_f = scene.control().k_f_per_kgm2(),
          .g = mcu.g_rad_s(),
          .g_v = mcu.g_v_rad_s()};
}

double slave_radius(const scene::Scene& scene, const Contact& contact) {
  return is_elastic(scene) ? spectral_radius(orthosis_loop(scene, contact))
                           : spectral_radius(direct_slave_loop(scene, contact));
}

double needed_playout_s(const scene::Path& path) {
  const double jitter = path.jitter_s();
  if (path.distribution() == scene::UNIFORM) return 2.0 * jitter;
  // The play-out follows the 99.7 % quantile, over the fastest of as many packets.
  constexpr double kQuantile = 2.8;
  if (path.distribution() == scene::NORMAL_DISTRIBUTION)
    return kQuantile * jitter + std::min(kQuantile * jitter, path.delay_s());
  return 0.0;
}

std::optional<SteadyContact> steady_contact(const scene::Scene& scene, const Contact& contact) {
  if (!(contact.k > 0.0)) return {};
  const auto [position, force] = scale_of(scene);
  return SteadyContact{.K_h = master_world_params(scene).load.K_h,
                       .reach = reach(scene, contact),
                       .k = position * force * contact.k,
                       .K_p = scene.control().k_p_per_s2(),
                       .K_f = master_K_f(scene)};
}

double alpha_in(const scene::Scene& scene, const Contact& contact) {
  if (!has_cdob(scene)) return 0.0;
  const auto steady = steady_contact(scene, contact);
  if (!has_sdcv(scene) || !steady) return 1.0;
  if (names_thresholds(scene, contact)) return 0.0;  // pressed and held, it is above its own f_2
  const double force = scale_of(scene).force;
  const double f_1 = force * scene.control().f_1_nm(), f_2 = force * scene.control().f_2_nm();
  if (scene.control().local_model() == scene::THESIS) return resting_alpha(*steady, f_1, f_2);
  return std::clamp((f_2 - steady->slave_torque(0.0)) / (f_2 - f_1), 0.0, 1.0);  // this model costs no force
}

namespace {

// From the fastest packet on, each way is held to the depth of the play-out, and shown at a tick.
int round_trip_ticks(const scene::Scene& scene) {
  const auto way = [tick = scene.tick_s()](const scene::Path& path) {
    return static_cast<int>(std::max(1.0, std::ceil((path.delay_s() + 0.5 * needed_playout_s(path)) / tick - 1e-6)));
  };
  const double serial_s = is_elastic(scene) ? 2.0 * scene.slave().series_elastic().serial_one_way_s() : 0.0;
  return way(scene.network().forward()) + way(scene.network().backward()) +
         static_cast<int>(std::ceil(serial_s / scene.tick_s()));
}

}  // namespace

Teleoperator teleoperator(const scene::Scene& scene, const Contact& contact) {
  const double tick = scene.tick_s();
  Teleoperator t;
  t.master = master_loop(scene);
  t.round_trip = round_trip_ticks(scene);
  t.slave = [slave = is_elastic(scene)
                         ? orthosis_slave(orthosis_loop(scene, contact), tick, scene.control().g_v_rad_s())
                         : direct_slave(direct_slave_loop(scene, contact)),
             scale = scale_of(scene)](std::complex<double> z) {
    const SideResponse::Sent sent = slave(z);
    return SideResponse::Sent{sent.x, sent.v, scale.position * scale.force * sent.f};
  };
  t.compensated = has_cdob(scene);
  t.with_force = scene.control().local_model() == scene::WITH_FORCE;
  t.alpha = alpha_in(scene, contact);
  t.g_net = scene.control().g_net_rad_s();
  return t;
}

TwoChannels two_channels(const scene::Scene& scene, const Contact& contact) {
  const scene::Control& c = scene.control();
  const auto force_alone = [](auto loop) {
    loop.K_p = loop.K_d = 0.0;
    return loop;
  };
  return {.master = force_alone(master_loop(scene)),
          .slave = is_elastic(scene)
                       ? orthosis_slave(force_alone(orthosis_loop(scene, contact)), scene.tick_s(), c.g_v_rad_s())
                       : direct_slave(force_alone(direct_slave_loop(scene, contact))),
          .K_f_slave = c.k_f_per_kgm2(),
          .round_trip = round_trip_ticks(scene),
          .K_2 = c.k_2_nm_per_rad(),
          .B_2 = c.b_2_nms_per_rad(),
          .B_slave = c.b_slave_nms_per_rad()};
}

}  // namespace farhand
