#include "netem/lab/simulation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "common/config/operator_timeline.hpp"
#include "common/law/architectures.hpp"
#include "common/link/codec.hpp"
#include "common/record/friction_in_force.hpp"
#include "common/record/harder_tendons.hpp"
#include "common/record/sample.hpp"
#include "common/station/journal.hpp"
#include "netem/lab/emulated_slave.hpp"
#include "netem/lab/host_stalls.hpp"
#include "netem/link_params.hpp"
#include "netem/pending.hpp"

namespace farhand {
namespace {

// A clock that started elsewhere and runs at its own pace.
struct LocalClock {
  Nanoseconds offset = 0;
  double skew = 0.0;  // seconds gained per second

  Nanoseconds at(Nanoseconds t) const {
    return offset + t + static_cast<Nanoseconds>(std::llround(skew * static_cast<double>(t)));
  }
  // When it shows offset + own.
  Nanoseconds when(Nanoseconds own) const {
    return static_cast<Nanoseconds>(std::llround(static_cast<double>(own) / (1.0 + skew)));
  }
};

class Run {
 public:
  Run(const scene::Scene& scene, const Sides& sides, Witness& witness)
      : tick_(from_seconds(scene.tick_s())),
        end_(from_seconds(scene.duration_s())),
        master_(*sides.master),
        slave_(*sides.slave),
        witness_(witness),
        forward_(link_params(scene.network().forward()), scene.seed(), LinkDirection::kForward),
        backward_(link_params(scene.network().backward()), scene.seed(), LinkDirection::kBackward),
        codec_(master_.packet_parts()),
        to_slave_(room(scene, scene.network().forward(), scene.slave().host())),
        to_master_(room(scene, scene.network().backward(), scene.master().host())),
        master_stalls_(scene, true),
        slave_stalls_(scene, false),
        acts_(scene, Role::kLeader),
        patient_acts_(scene, Role::kFollower) {
    slave_clock_.offset = from_seconds(scene.network().peer_clock_offset_s());
    slave_clock_.skew = scene.network().peer_clock_skew_ppm() * 1e-6;
  }

  RunCounters to_end() {
    Nanoseconds next_master = 0, next_slave = 0;
    std::int64_t master_ticks = 0, slave_ticks = 0;
    while (true) {
      const Nanoseconds t = std::min(next_master, next_slave);
      if (t > end_) break;
      const bool master_stalls = master_stalls_.at(t), slave_stalls = slave_stalls_.at(t);
      // Ticks of the same instant do not hear each other: neither machine goes first. What comes to a host that stalls
      // waits in its socket.
      if (!slave_stalls) deliver(to_slave_, t, slave_, slave_clock_, slave_rejected_);
      if (!master_stalls) deliver(to_master_, t, master_, {}, master_rejected_);
      if (next_master == t) {
        if (master_stalls) {
          stall(true, t);
        } else {
          tick(true, t, t, acts_.next(to_seconds(t), both_ready(master_, t)));
        }
        next_master = ++master_ticks * tick_;
      }
      if (next_slave == t) {
        const Nanoseconds now = slave_clock_.at(t);
        if (slave_stalls) {
          stall(false, t);
        } else {
          tick(false, t, now, patient_acts_.next(to_seconds(t), both_ready(slave_, now)));
        }
        next_slave = slave_clock_.when(++slave_ticks * tick_);
      }
    }
    return {counters(master_, master_rejected_, master_ticks, missed_[0]),
            counters(slave_, slave_rejected_, slave_ticks, missed_[1])};
  }

 private:
  void tick(bool master, Nanoseconds t, Nanoseconds now, OperatorAct act) {
    const double t_s = to_seconds(t);
    Side& side = master ? master_ : slave_;
    const std::uint64_t gap = std::exchange(gap_[master ? 0 : 1], 0);
    const Packet<1> packet = side.tick(now, t_s, act, static_cast<int>(std::min<std::uint64_t>(gap, 1'000'000)) + 1);
    witness_.ticked(master, side, t_s, act);
    send(packet, t, master);
  }

  void stall(bool master, Nanoseconds t) {
    ++missed_[master ? 0 : 1];
    ++gap_[master ? 0 : 1];
    Side& side = master ? master_ : slave_;
    side.go_on(to_seconds(t));
    witness_.stalled(master, side, to_seconds(t));
  }

  void send(const Packet<1>& packet, Nanoseconds t, bool forward) {
    const LinkModel::Fate fate = (forward ? forward_ : backward_).offer(t);
    const double delay = to_seconds(fate.delay);
    witness_.sent(
        {to_seconds(t), forward, fate.lost, delay, fate.lost ? std::numeric_limits<double>::quiet_NaN() : delay});
    if (fate.lost) return;
    if (!(forward ? to_slave_ : to_master_).push(t + fate.delay, codec_.encode(packet))) {
      throw std::logic_error("the link of the lab holds more datagrams than it has room for");
    }
  }

  static std::size_t room(const scene::Scene& scene, const scene::Path& path, const scene::Host& host) {
    return datagrams_on_way(path, scene.tick_s()) + static_cast<std::size_t>(2 * host.stall_s() / scene.tick_s());
  }

  // What came while the host stalled is read when it goes on.
  void deliver(PendingDatagrams& way, Nanoseconds t, Side& to, const LocalClock& clock, std::uint64_t& rejected) {
    const bool waited = gap_[&to == &master_ ? 0 : 1] > 0;
    while (!way.empty() && way.due() <= t) {
      const Nanoseconds due = waited ? t : way.due();
      Packet<1> packet;
      if (codec_.decode(way.pop(), packet) != DecodeResult::kOk) {
        ++rejected;
      } else {
        to.receive(packet, clock.at(due));
      }
    }
  }

  static StationCounters counters(const Side& side, std::uint64_t rejected, std::int64_t ticks, std::uint64_t missed) {
    StationCounters counters = counters_of(side.receiver().counters());
    counters.serial_sent = side.serial_counters().sent;
    counters.serial_received = side.serial_counters().received;
    counters.serial_crc_errors = side.serial_counters().crc_errors;
    counters.ticks = counters.sent = static_cast<std::uint64_t>(ticks) - missed;
    counters.missed_ticks = missed;
    counters.rejected_format = rejected;
    counters.cut_ticks = side.trace().cuts;
    return counters;
  }

  Nanoseconds tick_, end_;
  Side &master_, &slave_;
  Witness& witness_;
  LinkModel forward_, backward_;
  LocalClock slave_clock_;
  PacketCodec<1> codec_;
  PendingDatagrams to_slave_, to_master_;
  HostStalls master_stalls_, slave_stalls_;
  std::uint64_t master_rejected_ = 0, slave_rejected_ = 0;
  std::uint64_t missed_[2] = {}, gap_[2] = {};  // ticks of master and slave: of the run, and of the stall under way
  OperatorTimeline acts_, patient_acts_;
};

// Keeps every row, packet and event.
class Keeper final : public Witness {
 public:
  Keeper(const LoadedScene& loaded, const std::function<void(double)>& progress) : progress_(progress) {
    const auto rows = static_cast<std::size_t>(loaded.scene.duration_s() / loaded.scene.tick_s()) + 2;
    session.scene_name = loaded.name;
    session.scene_text = complete_text(loaded.scene);
    session.seed = loaded.scene.seed();
    session.deterministic = true;
    const Architecture& laws = architecture(scene::Architecture_Name(loaded.scene.architecture()));
    session.master_signals = names_of(laws.master.signals);
    session.slave_signals = names_of(laws.slave.signals);
    tendons_ = HarderTendons(session.master_signals, loaded.scene.control().force_scale());
    session.master.reserve(rows);
    session.slave.reserve(rows);
    session.link.reserve(2 * rows);
  }

  void ticked(bool master, const Side& side, double t_s, OperatorAct act) override {
    std::vector<StationSample>& rows = master ? session.master : session.slave;
    const char* who = master ? "master" : "slave";
    (master ? master_journal_ : slave_journal_)
        .step(t_s, side.trace(), act, nullptr, why_of(side), [&](std::string_view sentence) {
          session.events.push_back({t_s, who, std::string(sentence)});
        });
    if (master) {
      const std::string_view harder = tendons_.step(side.trace(), side.receiver().newest());
      if (!harder.empty()) session.events.push_back({t_s, who, std::string(harder)});
    } else {
      friction_.step(side.trace(), 0);
      session.friction = friction_.now();
    }
    rows.push_back(sample_of(side.trace(), side.receiver(), side.truth(), t_s));
    if (progress_ && t_s >= next_report_s_) {
      progress_(t_s);
      next_report_s_ += 1.0;
    }
  }
  void sent(const LinkSample& packet) override { session.link.push_back(packet); }

  Session session;

 private:
  const std::function<void(double)>& progress_;
  Journal master_journal_, slave_journal_;
  FrictionInForce friction_;
  HarderTendons tendons_;
  double next_report_s_ = 0;
};

}  // namespace

Sides make_sides(const scene::Scene& scene) {
  const bool elastic = scene.slave().device() == scene::SERIES_ELASTIC;
  return {make_simulated_master(scene, kMasterSession),
          elastic ? make_emulated_slave(scene, kSlaveSession) : make_simulated_slave(scene, kSlaveSession)};
}

RunCounters simulate(const LoadedScene& loaded, const Sides& sides, Witness& witness) {
  return Run(loaded.scene, sides, witness).to_end();
}

Session simulate(const LoadedScene& loaded, const std::function<void(double)>& progress) {
  Keeper keeper(loaded, progress);
  const RunCounters counters = simulate(loaded, make_sides(loaded.scene), keeper);
  keeper.session.master_counters = counters.master;
  keeper.session.slave_counters = counters.slave;
  return std::move(keeper.session);
}

}  // namespace farhand
