#include "netem/lab/fault_rig.hpp"

#include <algorithm>
#include <cmath>

#include "common/config/station_params.hpp"
#include "common/config/world_params.hpp"
#include "common/device/mcu_axis.hpp"
#include "common/device/simulated_axis.hpp"
#include "common/link/codec.hpp"
#include "common/runtime/side_of.hpp"
#include "netem/lab/sealed_pair.hpp"
#include "slave/emulator_params.hpp"

namespace farhand {
namespace {

constexpr Nanoseconds kEpoch = 100'000 * kSecond;  // clocks have run for a while
constexpr std::size_t kSocket = 256;               // what waits for a process that does not read; the rest is dropped

// A simulated axis whose encoder can fail.
template <class World>
class FailingAxis {
 public:
  using Io = DirectIo<1>;

  FailingAxis(const typename World::Params& params, const WorldNumerics& numerics,
              const std::function<double(double)>& reading)
      : axis_(params, numerics), reading_(reading) {}

  Io::Sensed read(double t_s) noexcept {
    Io::Sensed sensed = axis_.read(t_s);
    if (reading_) sensed.x[0] = reading_(sensed.x[0]);
    return sensed;
  }
  static constexpr bool kSimulated = true;
  void power_stage(const TorqueHold& contract) noexcept { axis_.power_stage(contract); }
  void write(const Io::Command& command, double t_s) noexcept { axis_.write(command, t_s); }
  Truth truth() const noexcept { return axis_.truth(); }

 private:
  SimulatedAxis<World> axis_;
  const std::function<double(double)>& reading_;
};

}  // namespace

void Way::post(Letter letter) {
  const auto later = std::ranges::upper_bound(pending, letter.due, {}, &Letter::due);
  pending.insert(later, std::move(letter));
}

// The two ends of the secured link.
struct FaultRig::Link {
  std::optional<SealedPair> master_key, slave_key;
  PacketCodec<1> codec;
};

// The slave's end of the cable, as McuAxis takes a port. It counts time from the start of its process.
class FaultRig::Port {
 public:
  explicit Port(FaultRig& rig) : rig_(rig) {}

  std::size_t read(std::span<std::uint8_t> bytes, double /*t_s*/) noexcept {
    rig_.carry_from_mcu();
    std::size_t count = 0;
    for (auto& waiting = rig_.from_mcu_; count < bytes.size() && !waiting.empty() && waiting.front().due <= rig_.now;) {
      bytes[count++] = waiting.front().value;
      waiting.pop_front();
    }
    for (std::size_t k = 0; k < count; ++k) bytes[k] = carried(bytes[k]);
    return rig_.cable.from_mcu && rig_.cable.plugged ? count : 0;
  }
  bool write(std::span<const std::uint8_t> bytes, double /*t_s*/) noexcept {
    for (std::uint8_t byte : bytes) {
      byte = carried(byte);
      if (rig_.cable.to_mcu && rig_.cable.plugged) rig_.to_mcu_.push_back({rig_.now + rig_.cable.lag_to_mcu, byte});
    }
    rig_.carry_to_mcu();
    return rig_.cable.plugged;
  }
  // What the adapter has, or what lags, cannot be called back.
  void drop_unsent(double /*t_s*/) noexcept { rig_.orthosis_->drop_unsent(rig_.mcu_time(rig_.now)); }
  bool lost() noexcept { return !rig_.cable.plugged; }

  Truth truth() const noexcept {
    const SeriesElasticWorld::Truth world = rig_.orthosis_->emulator().world().truth();
    return {world.x, world.v, world.f};
  }

 private:
  std::uint8_t carried(std::uint8_t byte) noexcept {
    Cable& cable = rig_.cable;
    if (cable.noise == 0 || static_cast<double>(cable.dice() >> 11) * 0x1p-53 >= cable.noise) return byte;
    return static_cast<std::uint8_t>(cable.dice());
  }
  FaultRig& rig_;
};

FaultRig::FaultRig(const scene::Scene& scene)
    : now(-from_seconds(scene.tick_s())),
      forward{from_seconds(scene.network().forward().delay_s()), false, {}, {}},
      backward{from_seconds(scene.network().backward().delay_s()), false, {}, {}},
      scene_(scene),
      tick_(from_seconds(scene.tick_s())),
      link_(std::make_unique<Link>()) {
  if (scene.slave().device() == scene::SERIES_ELASTIC) {
    orthosis_ = std::make_unique<OrthosisOnSerial>(emulator_params(scene), 1.5e-3);
  }
  master.in = &backward;
  slave.in = &forward;
  restart_master();
  restart_slave();
}
FaultRig::~FaultRig() = default;

void FaultRig::start(Process& process, std::unique_ptr<Side> side) {
  process.side = std::move(side);
  process.runs = true;
  process.started = process.ticked = now;
  link_->master_key.emplace(sessions_);
  link_->slave_key.emplace(sessions_);
}

void FaultRig::restart_master() {
  start(master, std::make_unique<SideOf<FailingAxis<MasterWorld>>>(master_station_params(scene_, ++sessions_),
                                                                   master_world_params(scene_), world_numerics(scene_),
                                                                   master_reading));
}

void FaultRig::restart_slave() {
  const StationParams params = slave_station_params(scene_, ++sessions_);
  if (orthosis_ != nullptr) {
    start(slave, std::make_unique<SideOf<McuAxis<Port>>>(params, *this));
  } else {
    start(slave, std::make_unique<SideOf<FailingAxis<DirectSlaveWorld>>>(params, direct_slave_world_params(scene_),
                                                                         world_numerics(scene_), slave_reading));
  }
}

void FaultRig::change_key() { link_->slave_key.emplace(1'000'000 + ++sessions_); }

// What is left turns the joint with a thousandth of the torque. The hand must be there from the start, because the new
// orthosis' time starts at 0.
void FaultRig::break_spring() {
  const SeriesElasticWorld::Truth truth = orthosis_->emulator().world().truth();
  SeriesElasticWorld::Params params = emulator_params(scene_).world;
  params.actuator.spring *= 1e-3;
  params.start = truth.x;
  params.stretch = truth.motor_x - truth.x;
  orthosis_->emulator().replace_world(params);
}

Nanoseconds FaultRig::mcu_time(Nanoseconds t) const noexcept {
  return cable.mcu_clock == 1.0 ? t : static_cast<Nanoseconds>(static_cast<double>(t) * cable.mcu_clock);
}

// Bytes keep their order, also when the lag shrinks.
void FaultRig::carry_to_mcu() {
  for (; !to_mcu_.empty() && to_mcu_.front().due <= now; to_mcu_.pop_front()) {
    orthosis_->send(&to_mcu_.front().value, 1, mcu_time(to_mcu_.front().due));
  }
}

void FaultRig::carry_from_mcu() {
  carry_to_mcu();
  orthosis_->advance(mcu_time(now));
  std::uint8_t byte = 0;
  while (orthosis_->receive(mcu_time(now), byte)) collected_.push_back({now + cable.lag_from_mcu, byte});
  if (collected_.size() < cable.collects && now - sent_on_ < cable.latency_timer) return;
  sent_on_ = now;
  from_mcu_.insert(from_mcu_.end(), collected_.begin(), collected_.end());
  collected_.clear();
}

OrthosisEmulator* FaultRig::orthosis() noexcept { return orthosis_ != nullptr ? &orthosis_->emulator() : nullptr; }

void FaultRig::tick() {
  now += tick_;
  for (Process* process : {&master, &slave}) {
    if (process->runs) deliver(*process);
  }
  run(master, forward, act);
  run(slave, backward, patient_act);
  if (orthosis_ != nullptr) {
    carry_to_mcu();
    orthosis_->advance(mcu_time(now));
  }
}

void FaultRig::deliver(Process& process) {
  MediaSession& session = &process == &master ? *link_->master_key->listener : *link_->slave_key->dialer;
  for (std::size_t k = 0; k < kSocket && !process.in->pending.empty() && process.in->pending.front().due <= now; ++k) {
    alignas(8) std::array<std::byte, MediaSession::kLargestDatagram> buffer;
    const std::vector<std::byte>& bytes = process.in->pending.front().bytes;
    std::ranges::copy(bytes, buffer.begin());
    std::span<std::byte> opened;
    Packet<1> packet;
    if (session.open(std::span(buffer).first(bytes.size()), opened) == MediaSession::Opening::kOpened &&
        link_->codec.decode(opened, packet) == DecodeResult::kOk) {
      process.side->receive(packet, kEpoch + now + process.clock);
    }
    process.in->pending.pop_front();
  }
}

void FaultRig::run(Process& process, Way& out, OperatorAct& act_now) {
  if (!process.runs) {
    std::size_t waiting = 0;
    std::erase_if(process.in->pending, [&](const Letter& letter) { return letter.due <= now && ++waiting > kSocket; });
    return;
  }
  const int ticks = std::max(1, static_cast<int>((now - process.ticked) / tick_));
  process.ticked = now;
  Packet<1> packet =
      process.side->tick(kEpoch + now + process.clock, to_seconds(now - process.started), act_now, ticks);
  act_now = OperatorAct::kNone;
  if (out.content) out.content(packet);
  MediaSession& session = &process == &master ? *link_->master_key->listener : *link_->slave_key->dialer;
  const auto sealed = session.seal(link_->codec.encode(packet));
  if (out.cut) return;
  Letter letter{now + out.delay, {sealed.begin(), sealed.end()}};
  if (out.carry) {
    out.carry(out, std::move(letter));
  } else {
    out.post(std::move(letter));
  }
}

double FaultRig::torque() const noexcept {
  const double on_hand = std::abs(slave.side->truth().f);
  if (orthosis_ == nullptr) return std::max(on_hand, std::abs(slave.side->trace().effort));
  const OrthosisEmulator& emulator = orthosis_->emulator();
  const auto world = emulator.world().truth();
  const double told = std::abs(mcu::to_nm(emulator.core().torque_command()));
  return std::max({std::abs(world.f), std::abs(world.spring_torque), told});
}

double FaultRig::velocity() const noexcept {
  return orthosis_ != nullptr ? orthosis_->emulator().world().truth().v : slave.side->truth().v;
}

bool FaultRig::lets_go() const noexcept {
  if (orthosis_ == nullptr) return slave.side->trace().effort == 0;
  const OrthosisEmulator& emulator = orthosis_->emulator();
  const mcu::State state = emulator.output().state;
  if (!emulator.supplied()) return true;
  return emulator.core().torque_command() == 0 && (state == mcu::State::kSafe || state == mcu::State::kFault);
}

}  // namespace farhand
