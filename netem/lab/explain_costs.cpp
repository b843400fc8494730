#include "netem/lab/explain_costs.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "common/config/station_params.hpp"
#include "common/config/world_params.hpp"
#include "common/device/mcu_axis.hpp"
#include "common/device/simulated_axis.hpp"
#include "common/link/codec.hpp"
#include "common/record/sample.hpp"
#include "common/runtime/owned_station.hpp"
#include "netem/lab/emulated_slave.hpp"
#include "netem/lab/explain_blocks.hpp"
#include "netem/lab/explain_link.hpp"
#include "netem/lab/measure.hpp"
#include "netem/lab/simulation.hpp"
#include "netem/lab/station_inputs.hpp"
#include "slave/emulator_params.hpp"

namespace farhand {
namespace {

template <class Io>
typename Io::Sensed sensed_in(const StationSample& row) {
  typename Io::Sensed sensed;
  sensed.x[0] = row.x_rad;
  if constexpr (requires { sensed.f; }) sensed.f[0] = row.f_nm;
  sensed.valid = true;
  return sensed;
}

class Meter {
 public:
  explicit Meter(const LoadedScene& loaded)
      : scene_(loaded.scene),
        session_(simulate(loaded)),
        master_{true, session_.master, arrivals_of(session_, true)},
        slave_{false, session_.slave, arrivals_of(session_, false)},
        dt_s_(scene_.tick_s()) {}

  void add(Explanation& to) {
    for (Block& block : to.blocks) {
      if (block.contained) block.cost = of(block);
    }
    to.master_law.cost = cost_of_law(master_, params(master_));
    to.slave_law.cost = cost_of_law(slave_, params(slave_));
    to.master_station = station<DirectIo<1>>(master_);
    to.slave_station = elastic() ? station<ReferenceIo<1>>(slave_) : station<DirectIo<1>>(slave_);
    whole(to);
  }

 private:
  bool elastic() const { return scene_.slave().device() == scene::SERIES_ELASTIC; }
  StationParams params(const BlockInputs& in) const {
    return in.master ? master_station_params(scene_, kMasterSession) : slave_station_params(scene_, kSlaveSession);
  }

  Cost of(const Block& block) {
    const BlockInputs& in = block.place == Place::kSlave ? slave_ : master_;
    const StationParams p = params(in);
    switch (block.id) {
      case BlockId::kReceiver:
        return receiver(in, p);
      case BlockId::kCodec:
        return codec();
      case BlockId::kDelay:
        return link();
      case BlockId::kMcu:
        return mcu();
      case BlockId::kSerial:
        return serial();
      case BlockId::kPlant:
      case BlockId::kHand:
      case BlockId::kWall:
      case BlockId::kFriction:
      case BlockId::kPlantWeight:
        return world(block);
      default:
        return cost_of_block(block, in, p);
    }
  }

  Cost receiver(const BlockInputs& in, const StationParams& p) const {
    return measure(in.rows.size(), [&] {
      Receiver<1> receiver(p.receive, p.session);
      auto next = in.arrivals.begin();
      for (const StationSample& row : in.rows) {
        const Nanoseconds now = from_seconds(row.t_s);
        for (; next != in.arrivals.end() && next->at <= now; ++next) receiver.accept(next->packet, next->at);
        keep(receiver.play(now));
      }
    });
  }

  template <class Io>
  Cost station(const BlockInputs& in) const {
    return measure(in.rows.size(), [&] {
      OwnedStation<Io> station(params(in));
      auto next = in.arrivals.begin();
      int act = 0;
      for (const StationSample& row : in.rows) {
        const Nanoseconds now = from_seconds(row.t_s);
        for (; next != in.arrivals.end() && next->at <= now; ++next) station.receive(next->packet, next->at);
        const bool engage =
            in.master && act < scene_.operator_acts_size() && scene_.operator_acts(act).at_s() <= row.t_s;
        if (engage) ++act;
        keep(station.tick(now, sensed_in<Io>(row), engage ? OperatorAct::kEngage : OperatorAct::kNone));
      }
    });
  }

  Cost codec() const {
    PacketCodec<1> codec;
    return measure(slave_.arrivals.size(), [&] {
      Packet<1> decoded;
      for (const Arrival& arrival : slave_.arrivals) {
        keep(codec.decode(codec.encode(arrival.packet), decoded));
        keep(decoded);
      }
    });
  }

  Cost link() const {
    return measure(master_.rows.size(), [&] { keep(carry(scene_, master_.rows.size())); });
  }

  Cost mcu() const {
    const OrthosisEmulator::Params p = emulator_params(scene_);
    const mcu::McuParams fixed = mcu::make_mcu_params(p.mcu);
    const double loops = p.mcu.loop_hz * dt_s_, unit = mcu::encoder_unit_rad(p.world.actuator.joint_counts_per_rev);
    return measure(slave_.rows.size(), [&] {
      mcu::OrthosisMcu core(fixed);
      double due = 0;
      for (const StationSample& row : slave_.rows) {
        const auto counts = static_cast<std::int32_t>(std::lround(row.x_rad / unit));
        for (due += loops; due >= 1; due -= 1) keep(core.step({counts, counts + 20, 25, false}));
      }
    });
  }

  // A command there and telemetry back, encoded, carried byte by byte and decoded.
  Cost serial() const {
    return measure(slave_.rows.size(), [&] {
      SerialLine there(scene_.slave().series_elastic().serial_one_way_s()), back(there);
      mcu::FrameDecoder at_mcu, at_pc;
      std::uint8_t wire[mcu::kWireBytes], byte = 0, seq = 0;
      for (std::size_t k = 0; k < slave_.rows.size(); ++k) {
        const Nanoseconds now = from_seconds(slave_.rows[k].t_s);
        const StationSample& row = slave_.rows[k];
        mcu::encode(mcu::make_command(mcu::Mode::kTrack, seq++ & 15, row.target_x_rad, row.v_rad_s, row.f_nm), wire);
        there.send(wire, mcu::kWireBytes, now);
        while (there.receive(now, byte)) {
          if (at_mcu.push(byte)) keep(mcu::unpack_command(at_mcu.payload()));
        }
        back.send(wire, mcu::kWireBytes, now);
        while (back.receive(now, byte)) {
          if (at_pc.push(byte)) keep(mcu::unpack_telemetry(at_pc.payload()));
        }
      }
    });
  }

  // Through the whole scene once; each thousand ticks are a batch. With a second world that lacks a part, the
  // difference of the two, which take turns.
  template <class World>
  Cost world_cost(const BlockInputs& in, World world, World* less, double loops, bool torque) const {
    const auto chunk = [&](World& advanced, std::size_t from) {
      const double start = thread_ns();
      for (std::size_t k = from; k < from + kChunk; ++k) {
        const double input = torque ? in.rows[k].command_nm : in.rows[k].true_v_rad_s;
        const double t_s = in.rows[k].t_s;
        for (double i = 0; i < loops; ++i) advanced.advance(input, t_s + (i + 1) / loops * dt_s_);
      }
      return (thread_ns() - start) / static_cast<double>(kChunk);
    };
    std::vector<double> ns;
    for (std::size_t from = 0; from + kChunk <= in.rows.size(); from += kChunk) {
      const double whole = chunk(world, from);
      ns.push_back(less == nullptr ? whole : whole - chunk(*less, from));
    }
    return ns.empty() ? Cost{} : summary(std::move(ns));
  }
  template <class World>
  Cost world_cost(const Block& block, const BlockInputs& in, const typename World::Params& whole,
                  const typename World::Params& less, double loops, bool torque) const {
    const WorldNumerics numerics = world_numerics(scene_);
    if (block.id == BlockId::kPlant)
      return world_cost(in, World(whole, numerics), static_cast<World*>(nullptr), loops, torque);
    World lacking(less, numerics);
    return world_cost(in, World(whole, numerics), &lacking, loops, torque);
  }

  Cost world(const Block& block) const {
    if (block.place == Place::kWorldMaster) {
      const MasterWorld::Params whole = master_world_params(scene_);
      MasterWorld::Params less = whole;
      leave_out(block.id, less.motor);
      return world_cost<MasterWorld>(block, master_, whole, less, 1, true);
    }
    if (elastic()) {
      const SeriesElasticWorld::Params whole = series_elastic_world_params(scene_);
      SeriesElasticWorld::Params less = whole;
      leave_out(block.id, less.environment);
      if (block.id == BlockId::kFriction) less.actuator.tendon.reset();
      return world_cost<SeriesElasticWorld>(block, slave_, whole, less, scene_.slave().mcu().loop_hz() * dt_s_, false);
    }
    const DirectSlaveWorld::Params whole = direct_slave_world_params(scene_);
    DirectSlaveWorld::Params less = whole;
    leave_out(block.id, less.load);
    leave_out(block.id, less.motor);
    return world_cost<DirectSlaveWorld>(block, slave_, whole, less, 1, true);
  }
  static void leave_out(BlockId id, Environment::Params& environment) {
    if (id == BlockId::kHand) environment.hand.reset();
    if (id == BlockId::kWall) environment.wall.reset();
  }
  static void leave_out(BlockId id, MotorAxis::Params& motor) {
    if (id == BlockId::kPlantWeight) motor.gravity = 0;
    if (id == BlockId::kFriction) {
      motor.coulomb = 0;
      motor.bristle.reset();
    }
  }

  void whole(Explanation& to) const;

  static constexpr std::size_t kChunk = 1000;
  const scene::Scene& scene_;
  Session session_;
  BlockInputs master_, slave_;
  double dt_s_;
};

// A side with a stop watch around its tick.
class Timed final : public Side {
 public:
  explicit Timed(std::unique_ptr<Side> side) : side_(std::move(side)) {}
  Packet<1> tick(Nanoseconds now, double t_s, OperatorAct act, int ticks) noexcept override {
    const Clock::time_point start = Clock::now();
    const Packet<1> packet = side_->tick(now, t_s, act, ticks);
    ns = ns_since(start);
    return packet;
  }
  void know(const KnownFriction& friction) noexcept override { side_->know(friction); }
  void go_on(double t_s) noexcept override { side_->go_on(t_s); }
  Receipt receive(const Packet<1>& packet, Nanoseconds now) noexcept override { return side_->receive(packet, now); }
  PacketParts packet_parts() const noexcept override { return side_->packet_parts(); }
  const TickTrace<1>& trace() const noexcept override { return side_->trace(); }
  const Receiver<1>& receiver() const noexcept override { return side_->receiver(); }
  Truth truth() const noexcept override { return side_->truth(); }
  SerialCounters serial_counters() const noexcept override { return side_->serial_counters(); }
  bool device_valid() const noexcept override { return side_->device_valid(); }

  double ns = 0;  // of the last tick

 private:
  std::unique_ptr<Side> side_;
};

// Of each 1000 ticks the median, which an interruption does not move.
class Batches final : public Witness {
 public:
  Batches(const Timed& master, const Timed& slave, double watch_ns) : timed_{&master, &slave}, watch_ns_(watch_ns) {}
  void ticked(bool master, const Side&, double, OperatorAct) override {
    const int side = master ? 0 : 1;
    ticks_[side].push_back(timed_[side]->ns - watch_ns_);
    if (ticks_[side].size() < kTicks) return;
    medians[side].push_back(summary(std::exchange(ticks_[side], {})).ns_per_tick);
  }
  std::vector<double> medians[2];

 private:
  static constexpr std::size_t kTicks = 1000;
  const Timed* timed_[2];
  double watch_ns_;
  std::vector<double> ticks_[2];
};

void Meter::whole(Explanation& to) const {
  const double watch_ns = measure(1000, [] {
                            for (int k = 0; k < 1000; ++k) keep(Clock::now());
                          }).ns_per_tick;
  Sides plain = make_sides(scene_);
  auto master = std::make_unique<Timed>(std::move(plain.master)),
       slave = std::make_unique<Timed>(std::move(plain.slave));
  Batches batches(*master, *slave, watch_ns);
  const Sides sides{std::move(master), std::move(slave)};
  LoadedScene loaded;
  loaded.scene = scene_;
  simulate(loaded, sides, batches);
  if (!batches.medians[0].empty()) to.master_side = summary(batches.medians[0]);
  if (!batches.medians[1].empty()) to.slave_side = summary(batches.medians[1]);

  loaded.scene.set_duration_s(std::min(scene_.duration_s(), 3.0));
  std::vector<double> runs;
  for (int k = 0; k < 5; ++k) {
    const Sides again = make_sides(scene_);
    Witness nobody;
    const double start = thread_ns();
    const RunCounters counters = simulate(loaded, again, nobody);
    runs.push_back((thread_ns() - start) / static_cast<double>(counters.master.ticks));
  }
  to.run = summary(runs);
}

}  // namespace

void add_costs(const LoadedScene& loaded, Explanation& explanation) {
  LoadedScene part = loaded;  // contact in every shipped scene that has one; short enough to wait for
  part.scene.set_duration_s(std::min(part.scene.duration_s(), 14.0));
  Meter(part).add(explanation);
}

}  // namespace farhand
