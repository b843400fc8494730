#include "tests/lab/simulation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>

#include "common/config/operator_timeline.hpp"
#include "common/link/codec.hpp"
#include "common/record/sample.hpp"
#include "netem/link_params.hpp"
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

// Datagrams on their way, in the order of their arrival.
struct InFlight {
  Nanoseconds due;
  std::uint64_t order;
  bool forward;
  std::array<std::byte, PacketCodec<1>::kSize> bytes;
  bool operator>(const InFlight& other) const { return std::tie(due, order) > std::tie(other.due, other.order); }
};

class Run {
 public:
  explicit Run(const LoadedScene& loaded)
      : scene_(loaded.scene),
        master_(make_simulated_master(scene_, kMasterSession)),
        slave_(make_slave(scene_)),
        forward_(link_params(scene_.network().forward()), scene_.seed(), LinkDirection::kForward),
        backward_(link_params(scene_.network().backward()), scene_.seed(), LinkDirection::kBackward),
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
    InFlight datagram{t + fate.delay, sent_++, forward, {}};
    const std::span<const std::byte> bytes = codec_.encode(packet);
    std::copy(bytes.begin(), bytes.end(), datagram.bytes.begin());
    in_flight_.push(datagram);
  }

  void deliver(Nanoseconds t) {
    while (!in_flight_.empty() && in_flight_.top().due <= t) {
      const InFlight datagram = in_flight_.top();
      in_flight_.pop();
      Packet<1> packet;
      if (codec_.decode(datagram.bytes, packet) != DecodeResult::kOk) {
        ++(datagram.forward ? slave_rejected_ : master_rejected_);
      } else if (datagram.forward) {
        slave_->receive(packet, slave_clock_.at(datagram.due));
      } else {
        master_->receive(packet, datagram.due);
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
  std::priority_queue<InFlight, std::vector<InFlight>, std::greater<>> in_flight_;
  Session session_;
  std::uint64_t sent_ = 0, master_rejected_ = 0, slave_rejected_ = 0;
  OperatorTimeline acts_;
};

}  // namespace

Session simulate(const LoadedScene& loaded, const std::function<void(double)>& progress) {
  return Run(loaded).to_end(progress);
}

}  // namespace farhand
