#include "tests/lab/audited_sides.hpp"

#include "common/config/station_params.hpp"
#include "common/config/world_params.hpp"
#include "common/device/mcu_axis.hpp"
#include "common/device/mcu_si.hpp"
#include "common/runtime/side_of.hpp"
#include "slave/emulator_params.hpp"

namespace farhand {
namespace {

// As SimulatedAxis, audited.
template <class World>
class AuditedAxis {
 public:
  using Drive = DirectDrive<1>;

  AuditedAxis(const typename World::Params& params, const WorldNumerics& numerics, EnergyBalance& balance)
      : world_(params, numerics), audit_(params, numerics), balance_(balance) {}

  Drive::Sensed read(double t_s) noexcept {
    if (t_s > t_s_) {
      world_.advance(torque_, t_s_, t_s);
      audit_.add(world_, torque_, t_s_, t_s, balance_);
      t_s_ = t_s;
    }
    Drive::Sensed sensed;
    sensed.x[0] = world_.encoder();
    return sensed;
  }
  void write(const Drive::Command& command, double /*t_s*/) noexcept { torque_ = command.torque[0]; }
  Truth truth() const noexcept {
    const auto truth = world_.truth();
    return {truth.x, truth.v, truth.f};
  }

 private:
  World world_;
  EnergyAudit<World> audit_;
  EnergyBalance& balance_;
  double torque_ = 0.0, t_s_ = 0.0;
};

// As the port of the emulated slave, audited loop by loop of the MCU: its command is held for one loop.
class AuditedPort {
 public:
  AuditedPort(const scene::Scene& scene, EnergyBalance& balance)
      : orthosis_(emulator_params(scene), scene.slave().series_elastic().serial_one_way_s()),
        audit_(series_elastic_world_params(scene), world_numerics(scene)),
        balance_(balance),
        loop_s_(1.0 / scene.slave().mcu().loop_hz()) {}

  std::size_t read(std::span<std::uint8_t> bytes, double t_s) noexcept {
    const Nanoseconds now = from_seconds(t_s);
    const OrthosisEmulator& emulator = orthosis_.emulator();
    for (; emulator.next_tick() <= now; ++loops_) {
      const double held = mcu::to_rad_s(emulator.output().motor_velocity);
      orthosis_.advance(emulator.next_tick());
      if (loops_ > 0) audit_.add(emulator.world(), held, loop_s_ * (loops_ - 1), loop_s_ * loops_, balance_);
    }
    std::size_t count = 0;
    while (count < bytes.size() && orthosis_.receive(now, bytes[count])) ++count;
    return count;
  }
  bool write(std::span<const std::uint8_t> bytes, double t_s) noexcept {
    orthosis_.send(bytes.data(), bytes.size(), from_seconds(t_s));
    return true;
  }
  bool lost() noexcept { return false; }
  Truth truth() const noexcept {
    const auto truth = orthosis_.emulator().world().truth();
    return {truth.x, truth.v, truth.f};
  }

 private:
  OrthosisOnSerial orthosis_;
  EnergyAudit<SeriesElasticWorld> audit_;
  EnergyBalance& balance_;
  double loop_s_, loops_ = 0;
};

template <template <class> class Scene>
std::unique_ptr<Side> master(const scene::Scene& scene, EnergyBalance& balance) {
  return std::make_unique<SideOf<Scene, AuditedAxis<MasterWorld>>>(
      master_station_params(scene, kMasterSession), master_world_params(scene), world_numerics(scene), balance);
}

}  // namespace

Sides make_audited_sides(const scene::Scene& scene, Balances& balances) {
  Sides sides;
  sides.master = scene.architecture() == scene::FOUR_CHANNEL ? master<FourChannel>(scene, balances.master)
                 : scene.architecture() == scene::FOUR_CHANNEL_CDOB
                     ? master<FourChannelCdob>(scene, balances.master)
                     : master<FourChannelCdobSdcv>(scene, balances.master);
  const StationParams params = slave_station_params(scene, kSlaveSession);
  if (scene.slave().device() == scene::SERIES_ELASTIC) {
    sides.slave = std::make_unique<SideOf<FourChannel, McuAxis<AuditedPort>>>(params, scene, balances.slave);
  } else {
    sides.slave = std::make_unique<SideOf<FourChannel, AuditedAxis<DirectSlaveWorld>>>(
        params, direct_slave_world_params(scene), world_numerics(scene), balances.slave);
  }
  return sides;
}

}  // namespace farhand
