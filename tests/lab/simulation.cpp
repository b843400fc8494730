#include "tests/lab/simulation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "common/config/operator_timeline.hpp"
#include "common/link/codec.hpp"
#include "common/record/sample.hpp"
#include "netem/link_params.hpp"
#include "netem/pending.hpp"
#include "tests/lab/emulated_slave.hpp"

namespace farhand {
namespace {

constexpr std::uint32_t kMasterSession = 1, kSlaveSession = 2;

std::unique_ptr<Side> make_slave(const scene::Scene& scene) {
  const bool elastic = scene.slave().device() == scene::SERIES_ELASTIC;
  return elastic ? make_emulated_slave(scene, kSlaveSession) : make_simulated_slave(scene, kSlaveSession);
}

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

// Room for everything that a direction can hold on its way; a normal delay beyond ten deviations is not to be met.
std::size_t room(const scene::Path& path, double tick_s) {
  return static_cast<std::size_t>((path.delay_s() + 10.0 * path.jitter_s()) / tick_s) + 16;
}

class Run {
 public:
  explicit Run(const LoadedScene& loaded)
      : scene_(loaded.scene),
        master_(make_simulated_master(scene_, kMasterSession)),
        slave_(make_slave(scene_)),
        forward_(link_params(scene_.network().forward()), scene_.seed(), LinkDirection::kForward),
        backward_(link_params(scene_.network().backward()), scene_.seed(), LinkDirection::kBackward),
        to_slave_(room(scene_.network().forward(), scene_.tick_s())),
        to_master_(room(scene_.network().backward(), scene_.tick_s())),
        acts_(scene_) {
    slave_clock_.offset = from_seconds(scene_.network().peer_clock_offset_s());
    slave_clock_.skew = scene_.network().peer_clock_skew_ppm() * 1e-6;
    session_.scene_name = loaded.name;
    session_.scene_text = complete_text(scene_);
    session_.seed = scene_.seed();
    session_.deterministic = true;
  }

  Session to_end(const std::function<void(double)>& progress) {
    const Nanoseconds dt = from_seconds(scene_.tick_s()), end = from_seconds(scene_.duration_s());
    const auto rows = static_cast<std::size_t>(end / dt + 1);
    session_.master.reserve(rows);
    session_.slave.reserve(rows);
    session_.link.reserve(2 * rows);
    Nanoseconds next_master = 0, next_slave = 0, next_report = 0;
    std::int64_t slave_ticks = 0;
    while (true) {
      const Nanoseconds t = std::min(next_master, next_slave);
      if (t > end) break;
      deliver(t);  // ticks of the same instant do not hear each other: neither machine goes first
      if (next_master == t) {
        tick(*master_, session_.master, "master", t, t, acts_.next(to_seconds(t)), true);
        next_master += dt;
      }
      if (next_slave == t) {
        tick(*slave_, session_.slave, "slave", t, slave_clock_.at(t), OperatorAct::kNone, false);
        next_slave = slave_clock_.when(++slave_ticks * dt);
      }
      if (progress && t >= next_report) {
        progress(to_seconds(t));
        next_report += kSecond;
      }
    }
    count(session_.master_counters, *master_, master_rejected_, session_.master.size());
    count(session_.slave_counters, *slave_, slave_rejected_, session_.slave.size());
    return std::move(session_);
  }

 private:
  void tick(Side& side, std::vector<StationSample>& rows, const char* who, Nanoseconds t, Nanoseconds now,
            OperatorAct act, bool forward) {
    const double t_s = to_seconds(t);
    const Packet<1> packet = side.tick(now, t_s, act, 1);
    const StationSample row = sample_of(side.trace(), side.receiver(), side.truth(), t_s);
    if (act != OperatorAct::kNone) session_.events.push_back({t_s, who, std::string("operator: ") + name_of(act)});
    if (rows.empty() || rows.back().state != row.state)
      session_.events.push_back(
          {t_s, who, std::string(name_of(static_cast<StationState>(row.state))) + ": " + name_of(side.trace().reason)});
    rows.push_back(row);
    send(packet, t, forward);
  }

  void send(const Packet<1>& packet, Nanoseconds t, bool forward) {
    const LinkModel::Fate fate = (forward ? forward_ : backward_).offer(t);
    const double delay = to_seconds(fate.delay);
    session_.link.push_back(
        {to_seconds(t), forward, fate.lost, delay, fate.lost ? std::numeric_limits<double>::quiet_NaN() : delay});
    if (fate.lost) return;
    if (!(forward ? to_slave_ : to_master_).push(t + fate.delay, codec_.encode(packet))) {
      throw std::logic_error("the link of the lab holds more datagrams than it has room for");
    }
  }

  void deliver(Nanoseconds t) {
    deliver(to_slave_, t, *slave_, slave_clock_, slave_rejected_);
    deliver(to_master_, t, *master_, {}, master_rejected_);
  }

  void deliver(PendingDatagrams& way, Nanoseconds t, Side& to, const LocalClock& clock, std::uint64_t& rejected) {
    while (!way.empty() && way.due() <= t) {
      const Nanoseconds due = way.due();
      Packet<1> packet;
      if (codec_.decode(way.pop(), packet) != DecodeResult::kOk) {
        ++rejected;
      } else {
        to.receive(packet, clock.at(due));
      }
    }
  }

  static void count(StationCounters& counters, const Side& side, std::uint64_t rejected, std::size_t ticks) {
    counters = counters_of(side.receiver().counters());
    counters.serial_sent = side.serial_counters().sent;
    counters.serial_received = side.serial_counters().received;
    counters.serial_crc_errors = side.serial_counters().crc_errors;
    counters.ticks = counters.sent = ticks;
    counters.rejected_format = rejected;
  }

  scene::Scene scene_;
  std::unique_ptr<Side> master_, slave_;
  LinkModel forward_, backward_;
  LocalClock slave_clock_;
  PacketCodec<1> codec_;
  PendingDatagrams to_slave_, to_master_;
  Session session_;
  std::uint64_t master_rejected_ = 0, slave_rejected_ = 0;
  OperatorTimeline acts_;
};

}  // namespace

Session simulate(const LoadedScene& loaded, const std::function<void(double)>& progress) {
  return Run(loaded).to_end(progress);
}

}  // namespace farhand
