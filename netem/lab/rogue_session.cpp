#include "netem/lab/rogue_session.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <stdexcept>

#include "common/config/load.hpp"
#include "common/config/station_params.hpp"
#include "common/config/world_params.hpp"
#include "common/runtime/side_of.hpp"
#include "netem/lab/rogue_device.hpp"
#include "netem/lab/rogue_peer.hpp"

namespace farhand::rogue {
namespace {

constexpr Nanoseconds kEpoch = 100'000 * kSecond;  // the clock has run for a while
constexpr double kShortest = 3.0;                  // s, of a session
constexpr double kAfter = 1.5;                     // s, that the person is watched after the last packet
constexpr double kGivesUp = 3.0;                   // s, where nobody engages

constexpr const char* kDevices[] = {"direct", "mcu", "lying-mcu"};
constexpr scene::Architecture kArchitectures[] = {
    scene::FOUR_CHANNEL,      scene::FOUR_CHANNEL_CDOB, scene::FOUR_CHANNEL_CDOB_SDCV,
    scene::MODEL_MEDIATED,    scene::TWO_CHANNEL,       scene::WAVE,
    scene::FOUR_CHANNEL_TANK, scene::AUTOMATIC,         scene::TWO_CHANNEL_PO_PC};

// The therapist's operator engages whenever it is possible, and again after a while.
class Operator {
 public:
  Operator(bool again) : again_(again) {}

  OperatorAct next(const Side& side, Nanoseconds now, double t_s) {
    if (engaged_ && !again_) return OperatorAct::kNone;
    if (!both_ready(side, now) || t_s < next_s_) return OperatorAct::kNone;
    engaged_ = true;
    next_s_ = t_s + 0.15;
    return OperatorAct::kEngage;
  }

 private:
  bool again_, engaged_ = false;
  double next_s_ = 0.1;
};

struct Flying {
  double due_s;
  Packet<1> packet;
};

// One side against the peer. Axis is what stands between the station and the person.
template <class A>
class Course {
 public:
  static constexpr bool kMcu = std::same_as<A, McuAxis<WatchedPort>>;

  Course(const Cell& cell, const Plan& plan, const Allowed& allowed, std::uint64_t seed, SideOf<A>& side)
      : cell_(cell),
        plan_(plan),
        side_(side),
        judge_(allowed),
        peer_(plan, cell.against, seed),
        operator_(plan.engages_again) {
    if constexpr (kMcu) {
      side_.axis().port.watch([this](AtPerson now) {
        now.driven = now.driven && drives(state_);
        judge_.see(now);
      });
    }
  }

  Outcome run() {
    double end = kShortest;
    double t = 0;
    for (std::int64_t k = 0; t <= end; t = static_cast<double>(++k) * 1e-3) {
      tick(t);
      if (peer_.engaged_once())
        end = std::max(kShortest, peer_.engaged_from_s() + plan_.attack_s + (plan_.falls_silent ? kAfter : 0.05));
      if (!peer_.engaged_once() && t > kGivesUp) break;
    }
    return {judge_.findings(), judge_.engaged_s(), t};
  }

 private:
  void tick(double t) {
    const Nanoseconds now = kEpoch + from_seconds(t);
    for (; !flying_.empty() && flying_.front().due_s <= t; flying_.pop_front()) {
      side_.receive(flying_.front().packet, now);
      judge_.last_packet(t);
    }
    const OperatorAct act = cell_.against == Against::kTherapist ? operator_.next(side_, now, t) : OperatorAct::kNone;
    double commanded = 0;
    if constexpr (!kMcu) commanded = side_.axis().commanded();
    const Packet<1> sent = side_.tick(now, t, act, 1);
    const Truth truth = side_.truth();
    if constexpr (!kMcu) {  // the torque and the state of the last tick led here
      judge_.see({.t_s = t,
                  .body = {.x = truth.x, .v = truth.v, .t_s = t},
                  .torque = truth.f,
                  .commanded = commanded,
                  .driven = drives(state_)});
    }
    judge_.see(side_.trace(), t);
    const bool engages = side_.trace().state == StationState::kEngaged && state_ != StationState::kEngaged;
    state_ = side_.trace().state;
    if constexpr (kMcu) {
      if (engages && !told_) side_.axis().port.engaged(t);
      told_ = told_ || engages;
    }
    for (const Packet<1>& packet : peer_.tick({t, truth.x, truth.v, truth.f, state_, sent}))
      flying_.push_back({t + 1e-3 + plan_.network_s - 1e-6, packet});
  }

  const Cell& cell_;
  const Plan& plan_;
  SideOf<A>& side_;
  Judge judge_;
  Peer peer_;
  Operator operator_;
  std::deque<Flying> flying_;
  StationState state_ = StationState::kOff;
  bool told_ = false;
};

std::string base_scene(const Cell& cell) {
  const bool direct = cell.device == Device::kDirect;
  std::string text = "architecture: " + scene::Architecture_Name(cell.architecture) + "\nduration_s: 10\ncontrol {";
  if (!direct) text += " K_f_per_kgm2: 125";  // what a loop behind an MCU bears
  if (cell.architecture == scene::WAVE) text += " wave_matching: SLAVE_END";
  return text +
         " }\nmaster { therapist { grip: CUSTOM } }\nslave { device: " + (direct ? "DIRECT_DRIVE" : "SERIES_ELASTIC") +
         " motor { stop_min_rad: -0.5236 stop_max_rad: 0.5236 } hand { stiffness_nm_per_rad: 2 } }\n";
}

}  // namespace

Allowed allowed_of(const scene::Scene& scene, const Cell& cell, const Plan& plan) {
  const bool therapist = cell.against == Against::kTherapist, mcu = cell.device != Device::kDirect;
  const scene::Axis& axis = therapist ? scene.master().axis() : scene.slave().axis();
  const scene::Motor& motor = therapist ? scene.master().motor() : scene.slave().motor();
  const scene::SeriesElastic& elastic = scene.slave().series_elastic();
  Allowed a;
  a.therapist = therapist;
  a.speed = axis.velocity_limit_rad_s();
  a.torque = axis.torque_limit_nm();
  a.power = scene.slave().limits().power_w();
  a.range = axis.range_max_rad();
  a.hold_spring = scene.control().k_p_per_s2() / scene.control().k_f_per_kgm2();
  const double J_person = therapist ? scene.master().therapist().j_h_kgm2() : 0.0;
  a.body = {.J = (mcu ? elastic.j_joint_kgm2() : motor.j_kgm2()) + J_person,
            .viscous = mcu ? elastic.viscous_nms_per_rad() : motor.viscous_nms_per_rad(),
            .K = plan.world.stiffness,
            .B = plan.world.damping,
            .spastic = plan.world.spastic,
            .J_person = J_person,
            .stop = mcu ? elastic.stop_max_rad() : motor.stop_max_rad(),
            .spring = mcu ? elastic.spring_nm_per_rad() : 0.0,
            .motor_hz = elastic.motor_bandwidth_hz(),
            .motor_limit = elastic.motor_speed_limit_rad_s(),
            .spring_gain = scene.slave().mcu().spring_gain_per_s(),
            .velocity_cutoff = scene.slave().mcu().g_v_rad_s(),
            .fastest = mcu::kFastest * a.speed,
            .frozen_from_s = plan.world.frozen_from_s};
  return a;
}

std::string name_of(const Cell& cell) {
  return std::string(cell.against == Against::kPatient ? "patient/" : "therapist/") +
         scene::Architecture_Name(cell.architecture) + '/' + kDevices[static_cast<int>(cell.device)];
}

std::vector<Cell> all_cells() {
  std::vector<Cell> cells;
  for (const Device device : {Device::kDirect, Device::kMcu, Device::kLyingMcu}) {
    for (const scene::Architecture architecture : kArchitectures)
      cells.push_back({Against::kPatient, architecture, device});
  }
  for (const scene::Architecture architecture : kArchitectures)
    cells.push_back({Against::kTherapist, architecture, Device::kDirect});
  return cells;
}

Cell cell_of(const std::string& name) {
  std::string known;
  for (const Cell& cell : all_cells()) {
    if (name_of(cell) == name) return cell;
    known += "\n  " + name_of(cell);
  }
  throw std::invalid_argument("no cell is called '" + name + "'; there are" + known);
}

double Outcome::ratio() const noexcept { return findings[static_cast<std::size_t>(worst())].ratio; }

Line Outcome::worst() const noexcept {
  std::size_t most = 0;
  for (std::size_t k = 1; k < kBoundLines; ++k) {
    if (findings[k].ratio > findings[most].ratio) most = k;
  }
  return static_cast<Line>(most);
}

Arena::Arena(const Cell& cell, const std::vector<std::string>& sets, double longer)
    : cell_(cell), scene_(load_scene_text(base_scene(cell), "rogue.txtpb", sets).scene), longer_(longer) {}

Plan Arena::plan_of(const Genome& genome) const {
  Plan plan = rogue::plan_of(genome, cell_.against);
  plan.attack_s *= longer_;
  return plan;
}

scene::Scene Arena::scene_of(const Plan& plan) const {
  scene::Scene scene = scene_;
  const WorldPlan& w = plan.world;
  if (cell_.against == Against::kTherapist) {
    scene::Therapist& person = *scene.mutable_master()->mutable_therapist();
    person.set_k_h_nm_per_rad(w.stiffness);
    person.set_b_h_nms_per_rad(w.damping);
    scene::Motor& motor = *scene.mutable_master()->mutable_motor();
    motor.set_j_kgm2(w.J_factor * motor.j_kgm2());
    motor.set_encoder_counts_per_rev(w.counts_per_rev);
    return scene;
  }
  scene::Hand& hand = *scene.mutable_slave()->mutable_hand();
  hand.set_stiffness_nm_per_rad(w.stiffness);
  hand.set_damping_nms_per_rad(w.damping);
  hand.set_spastic_nms_per_rad(w.spastic);
  scene::Motor& motor = *scene.mutable_slave()->mutable_motor();
  motor.set_j_kgm2(w.J_factor * motor.j_kgm2());
  motor.set_encoder_counts_per_rev(w.counts_per_rev);
  scene::SeriesElastic& elastic = *scene.mutable_slave()->mutable_series_elastic();
  elastic.set_j_joint_kgm2(w.J_factor * elastic.j_joint_kgm2());
  elastic.set_joint_counts_per_rev(w.counts_per_rev);
  elastic.set_motor_counts_per_rev(w.counts_per_rev);
  elastic.set_motor_speed_limit_rad_s(w.motor_speed_limit);
  return scene;
}

Outcome Arena::run(const Genome& genome) const {
  const Plan plan = plan_of(genome);
  const scene::Scene scene = scene_of(plan);
  const Allowed allowed = allowed_of(scene, cell_, plan);
  std::uint64_t seed = 1;
  for (const std::uint16_t gene : genome.genes) seed = seed * 6364136223846793005u + gene;

  const auto run = [&]<class A>(SideOf<A> side) { return Course<A>(cell_, plan, allowed, seed, side).run(); };
  const double frozen = plan.world.frozen_from_s;
  if (cell_.against == Against::kTherapist) {
    return run(SideOf<WatchedAxis<MasterWorld>>(master_station_params(scene, 1), master_world_params(scene),
                                                world_numerics(scene), frozen));
  }
  if (cell_.device == Device::kDirect) {
    return run(SideOf<WatchedAxis<DirectSlaveWorld>>(slave_station_params(scene, 1), direct_slave_world_params(scene),
                                                     world_numerics(scene), frozen));
  }
  return run(
      SideOf<McuAxis<WatchedPort>>(slave_station_params(scene, 1), scene, plan, cell_.device == Device::kLyingMcu));
}

}  // namespace farhand::rogue
