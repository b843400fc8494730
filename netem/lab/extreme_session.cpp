#include "netem/lab/extreme_session.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

#include "common/advice/warnings.hpp"
#include "common/config/operator_timeline.hpp"
#include "common/config/station_params.hpp"
#include "common/config/world_params.hpp"
#include "common/device/truth.hpp"
#include "common/runtime/side_of.hpp"
#include "netem/lab/emulated_slave.hpp"
#include "netem/pending.hpp"

namespace farhand::extreme {
namespace {

constexpr const char* kBase = R"(
architecture: FOUR_CHANNEL
duration_s: 7
master {
  motor { encoder_counts_per_rev: 0 }
  therapist { grip: NORMAL intended { duration_s: 2 } intended { duration_s: 1 ramp_to_rad: 0.3 } intended { duration_s: 1 } }
}
slave {
  motor { encoder_counts_per_rev: 0 stop_min_rad: -0.5236 stop_max_rad: 0.5236 }
  series_elastic { joint_counts_per_rev: 0 motor_counts_per_rev: 0 }
  hand { stiffness_nm_per_rad: 2 }
}
operator_acts { at_s: 0.2 act: ENGAGE }
)";

using Reading = std::function<double(double, double)>;

// SimulatedAxis with a watch on it.
template <class P>
class WatchedAxis {
 public:
  using Io = DirectIo<1>;

  WatchedAxis(const typename P::Params& params, const WorldNumerics& numerics, Watch& watch, EnergyMeter& meter,
              const Reading& reading, int pieces)
      : world_(params, numerics), plant_(params), watch_(watch), meter_(meter), reading_(reading), pieces_(pieces) {}

  Io::Sensed read(double t_s) noexcept {
    if (t_s > t_s_) {
      meter_.advance(world_, plant_, torque_, t_s_, t_s, pieces_);
      t_s_ = t_s;
    }
    watch_.see(Block::kIntegrator, world_.true_x());
    watch_.see(Block::kIntegrator, world_.true_v());
    if (world_.status() == IntegratorStatus::kDiverged) watch_.bad(Block::kIntegrator);
    Io::Sensed sensed;
    sensed.valid = world_.status() != IntegratorStatus::kDiverged;
    sensed.x[0] = reading_ ? reading_(t_s, world_.encoder()) : world_.encoder();
    watch_.see(Block::kEncoder, sensed.x);
    return sensed;
  }
  static constexpr bool kSimulated = true;
  void power_stage(const TorqueHold& /*contract*/) noexcept {}  // no tick is missed here
  void write(const Io::Command& command, double /*t_s*/) noexcept {
    torque_ = command.torque[0];
    watch_.command(torque_);
  }
  Truth truth() const noexcept { return {world_.true_x(), world_.true_v(), world_.true_f()}; }

 private:
  World<P> world_;
  P plant_;
  Watch& watch_;
  EnergyMeter& meter_;
  const Reading& reading_;
  int pieces_;
  double torque_ = 0, t_s_ = 0;
};

class Run {
 public:
  Run(const SessionPlan& plan, const scene::Scene& scene)
      : plan_(plan),
        forward_(link_params(scene.network().forward()), scene.seed(), LinkDirection::kForward),
        backward_(link_params(scene.network().backward()), scene.seed(), LinkDirection::kBackward),
        to_slave_(room(scene.network().forward(), scene.tick_s())),
        to_master_(room(scene.network().backward(), scene.tick_s())),
        acts_(scene, Role::kLeader) {
    record_.scene = scene;
    record_.master.who = "master";
    record_.slave.who = "slave";
    auto master_params = master_world_params(scene);
    master_params.start = plan.master_start;
    auto slave_params = direct_slave_world_params(scene);
    slave_params.start = plan.slave_start;
    const int pieces = 2 * std::max(2, static_cast<int>(std::ceil(scene.tick_s() / (2 * plan.meter_s))));
    master_ = make_master(scene, master_params, pieces);
    if (scene.slave().device() == scene::SERIES_ELASTIC) {
      slave_ = make_emulated_slave(scene, 2);
      metered_slave_ = false;
    } else {
      slave_ = std::make_unique<SideOf<WatchedAxis<DirectSlavePlant>>>(slave_station_params(scene, 2), slave_params,
                                                                       world_numerics(scene), watch_, slave_meter_,
                                                                       plan_.slave_encoder, pieces);
    }
  }

  SessionRecord to_end() {
    const scene::Scene& scene = record_.scene;
    const Nanoseconds dt = from_seconds(scene.tick_s()), end = from_seconds(scene.duration_s());
    const Nanoseconds steady = end - from_seconds(plan_.steady_s);
    const Nanoseconds offset = from_seconds(scene.network().peer_clock_offset_s());
    const double skew = scene.network().peer_clock_skew_ppm() * 1e-6;
    const auto slave_clock = [&](Nanoseconds t) {
      if (plan_.slave_clock) return plan_.epoch + plan_.slave_clock(t);
      return plan_.epoch + offset + t + static_cast<Nanoseconds>(std::llround(skew * static_cast<double>(t)));
    };
    Nanoseconds next_slave = 0;
    std::int64_t slave_ticks = 0;
    for (Nanoseconds t = 0; t <= end; t += dt) {
      deliver(to_slave_, t, *slave_, slave_clock, record_.slave);
      deliver(
          to_master_, t, *master_, [&](Nanoseconds due) { return plan_.epoch + due; }, record_.master);
      tick(*master_, t, plan_.epoch + t, acts_.next(to_seconds(t), both_ready(*master_, plan_.epoch + t)),
           record_.master, t > steady, forward_, to_slave_, plan_.to_slave);
      if (next_slave <= t) {
        tick(*slave_, t, slave_clock(t), OperatorAct::kNone, record_.slave, t > steady, backward_, to_master_,
             plan_.to_master);
        ++slave_ticks;
        next_slave = static_cast<Nanoseconds>(static_cast<double>(slave_ticks * dt) / (1.0 + skew));
      }
      ++record_.ticks;
    }
    finish(record_.master, *master_, master_meter_, true);
    finish(record_.slave, *slave_, slave_meter_, metered_slave_);
    record_.first_bad = watch_.first_bad();
    record_.bad_at_actuator = watch_.bad_at_actuator();
    return record_;
  }

 private:
  // For everything that a direction can hold on its way, and for what a tamperer adds.
  static std::size_t room(const scene::Path& path, double tick_s) {
    return 3 * static_cast<std::size_t>((path.delay_s() + 10 * path.jitter_s() + 1) / tick_s) + 64;
  }

  std::unique_ptr<Side> make_master(const scene::Scene& scene, const MasterPlant::Params& world, int pieces) {
    return std::make_unique<SideOf<WatchedAxis<MasterPlant>>>(master_station_params(scene, 1), world,
                                                              world_numerics(scene), watch_, master_meter_,
                                                              plan_.master_encoder, pieces);
  }

  void tick(Side& side, Nanoseconds t, Nanoseconds now, OperatorAct act, SideRecord& record, bool steady,
            LinkModel& link, PendingDatagrams& way, const std::function<std::vector<Letter>(const Letter&)>& tamper) {
    const Packet<1> packet = side.tick(now, to_seconds(t), act, 1);
    const TickTrace<1>& trace = side.trace();
    watch_.see(Block::kObserver, trace.local.v);
    watch_.see(Block::kObserver, trace.local.f);
    watch_.see(Block::kReceiver, trace.remote.x);
    watch_.see(Block::kReceiver, trace.remote.v);
    watch_.see(Block::kReceiver, trace.remote.f);
    watch_.see(Block::kLaw, trace.target.x);
    watch_.see(Block::kLaw, trace.target.v);
    watch_.see(Block::kLaw, trace.target.f);
    watch_.command(trace.effort);
    watch_.see(Block::kPacket, packet.motion.x);
    record.state = trace.state;
    record.reason = trace.reason;
    record.ever_engaged |= trace.state == StationState::kEngaged;
    record.ever_fault |= trace.state == StationState::kFault;
    record.limits |= trace.limits;
    record.command_most = std::max(record.command_most, std::abs(trace.effort));
    record.f_estimate_most = std::max(record.f_estimate_most, std::abs(trace.local.f[0]));
    const Truth truth = side.truth();
    record.x_most = std::max(record.x_most, std::abs(truth.x));
    if (steady) {
      record.x_low = std::min(record.x_low, truth.x);
      record.x_high = std::max(record.x_high, truth.x);
      record.f_mean += truth.f * record_.scene.tick_s() / plan_.steady_s;
    }
    const LinkModel::Fate fate = link.offer(t);
    ++record_.sent;
    if (fate.lost) return;
    Letter letter{t + fate.delay, {}};
    std::ranges::copy(codec_.encode(packet), letter.bytes.begin());
    if (!tamper) {
      way.push(letter.due, letter.bytes);
    } else {
      for (const Letter& one : tamper(letter)) way.push(one.due, one.bytes);
    }
  }

  template <class Clock>
  void deliver(PendingDatagrams& way, Nanoseconds t, Side& to, const Clock& clock, SideRecord& record) {
    while (!way.empty() && way.due() <= t) {
      const Nanoseconds due = way.due();
      Packet<1> packet;
      const DecodeResult result = codec_.decode(way.pop(), packet);
      ++record.decoded[static_cast<std::size_t>(result)];
      if (result == DecodeResult::kNotFinite) watch_.bad(Block::kLink);
      if (result == DecodeResult::kOk) to.receive(packet, clock(due));
    }
  }

  static void finish(SideRecord& record, const Side& side, const EnergyMeter& meter, bool metered) {
    record.received = side.receiver().counters();
    record.energy = metered ? meter.worst() : 0.0;
  }

  const SessionPlan& plan_;
  SessionRecord record_;
  Watch watch_;
  EnergyMeter master_meter_, slave_meter_;
  std::unique_ptr<Side> master_, slave_;
  bool metered_slave_ = true;
  LinkModel forward_, backward_;
  PacketCodec<1> codec_;
  PendingDatagrams to_slave_, to_master_;
  OperatorTimeline acts_;
};

}  // namespace

std::string SideRecord::state_text() const { return std::string(who) + " " + name_of(state) + ": " + name_of(reason); }

double SessionRecord::off(double master_x, double slave_x) const {
  return std::max({std::abs(master.x_low - master_x), std::abs(master.x_high - master_x),
                   std::abs(slave.x_low - slave_x), std::abs(slave.x_high - slave_x)});
}

SessionRecord run_session(const SessionPlan& plan) {
  const LoadedScene loaded = load_scene_text(kBase, "extreme.txtpb", plan.sets);
  SessionRecord record = Run(plan, loaded.scene).to_end();
  record.warnings = warnings(loaded.scene);
  return record;
}

Balance balance_of(const scene::Scene& scene) {
  const scene::Therapist& t = scene.master().therapist();
  const double K_h = t.grip() == scene::LIGHT    ? 0.5
                     : t.grip() == scene::NORMAL ? 3
                     : t.grip() == scene::FIRM   ? 10
                                                 : t.k_h_nm_per_rad();
  const bool wall = scene.slave().has_wall();
  const double k = wall                       ? scene.slave().wall().stiffness_nm_per_rad()
                   : scene.slave().has_hand() ? scene.slave().hand().stiffness_nm_per_rad()
                                              : 0;
  double A = 0;
  for (const scene::Movement& m : t.intended()) A = m.has_ramp_to_rad() ? m.ramp_to_rad() : A;
  if (scene.architecture() != scene::FOUR_CHANNEL_CDOB) {
    const double x = (K_h * A + (wall ? k * scene.slave().wall().at_rad() : 0)) / (K_h + k);
    return {x, x};
  }
  const double stretch = 1 + scene.control().k_f_per_kgm2() * k / (2 * scene.control().k_p_per_s2());
  const double slave = K_h * A / (K_h * stretch + k / 2);
  return {stretch * slave, slave};
}

Outcome judge_session(const SessionRecord& record, double master_x, double slave_x, std::string second_way) {
  Outcome out;
  out.first_bad = record.first_bad;
  out.bad_at_actuator = record.bad_at_actuator;
  out.work = record.ticks;
  out.energy = std::max(record.master.energy, record.slave.energy);
  out.second_way = std::move(second_way);
  out.unit = "rad";
  out.error = record.off(master_x, slave_x);
  const bool engaged = record.master.state == StationState::kEngaged && record.slave.state == StationState::kEngaged;
  out.what = record.master.state_text() + "; " + record.slave.state_text();
  if (!engaged) out.refusal = out.what;
  if (record.slave.limits != 0 || record.master.limits != 0) {
    out.what += "; limits";
    const std::uint32_t limits = record.slave.limits | record.master.limits;
    const char* const names[] = {" torque", " rate", " range", " speed", " not-finite", " device"};
    for (int bit = 0; bit < 6; ++bit) {
      if (limits >> bit & 1u) out.what += names[bit];
    }
  }
  return out;
}

Outcome judge_bounded(const SessionRecord& record) {
  Outcome out = judge_session(record, 0, 0, "stops, and the largest torque");
  out.error = std::max(record.master.x_most, record.slave.x_most);
  out.refusal.clear();
  out.what += record.warnings.empty() ? "; not warned of" : "; warned of at load: " + record.warnings.front();
  if (record.warnings.empty() && (record.master.limits | record.slave.limits) == 0) out.error = Outcome::kNan;
  return out;
}

Outcome judge_session(const SessionRecord& record) {
  const Balance balance = balance_of(record.scene);
  return judge_session(record, balance.master, balance.slave, "statics: arm and hand balance");
}

}  // namespace farhand::extreme
