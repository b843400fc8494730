#include "netem/lab/audited_sides.hpp"

#include <stdexcept>

#include "common/config/station_params.hpp"
#include "common/config/world_params.hpp"
#include "common/device/mcu_axis.hpp"
#include "common/device/mcu_si.hpp"
#include "common/device/simulated_axis.hpp"
#include "common/runtime/side_of.hpp"
#include "netem/lab/emulated_port.hpp"

namespace farhand {
namespace {

// A world whose energy is counted; SimulatedAxis takes it as it takes any.
template <class World>
class AuditedWorld {
 public:
  struct Params {
    typename World::Params world;
    EnergyBalance* balance;
  };

  AuditedWorld(const Params& params, const WorldNumerics& numerics)
      : world_(params.world, numerics), audit_(params.world, numerics), balance_(*params.balance) {}

  void advance(double input, double t1_s) noexcept {
    world_.advance(input, t1_s);
    audit_.add(world_, input, t_s_, t1_s, balance_);
    t_s_ = t1_s;
  }
  typename World::Truth truth() const noexcept { return world_.truth(); }
  double encoder() const noexcept { return world_.encoder(); }
  IntegratorStatus status() const noexcept { return world_.status(); }

 private:
  World world_;
  EnergyAudit<World> audit_;
  EnergyBalance& balance_;
  double t_s_ = 0.0;
};

// The port of the emulated slave, audited loop by loop of the MCU: its command is held for one loop.
class AuditedPort : public EmulatedPort {
 public:
  AuditedPort(const scene::Scene& scene, EnergyBalance& balance)
      : EmulatedPort(scene),
        audit_(series_elastic_world_params(scene), world_numerics(scene)),
        balance_(balance),
        loop_s_(1.0 / scene.slave().mcu().loop_hz()) {}

  std::size_t read(std::span<std::uint8_t> bytes, double t_s) noexcept {
    const Nanoseconds now = from_seconds(t_s);
    const OrthosisEmulator& emulator = orthosis().emulator();
    for (; emulator.next_tick() <= now; ++loops_) {
      const double held = mcu::to_rad_s(emulator.output().motor_velocity);
      orthosis().advance(emulator.next_tick());
      if (loops_ > 0) audit_.add(emulator.world(), held, loop_s_ * (loops_ - 1), loop_s_ * loops_, balance_);
    }
    return EmulatedPort::read(bytes, t_s);
  }

 private:
  EnergyAudit<SeriesElasticWorld> audit_;
  EnergyBalance& balance_;
  double loop_s_, loops_ = 0;
};

}  // namespace

Sides make_audited_sides(const scene::Scene& scene, Balances& balances) {
  // He answers to the angle alone, so that under given torques he lets the two worlds of an audit drift apart.
  if (scene.master().therapist().has_reaction())
    throw std::invalid_argument(
        "the energy of a therapist who gives way cannot be audited: master.therapist.reaction must be absent");
  Sides sides;
  using Master = AuditedWorld<MasterWorld>;
  sides.master = std::make_unique<SideOf<SimulatedAxis<Master>>>(
      master_station_params(scene, kMasterSession), Master::Params{master_world_params(scene), &balances.master},
      world_numerics(scene));
  const StationParams params = slave_station_params(scene, kSlaveSession);
  if (scene.slave().device() == scene::SERIES_ELASTIC) {
    sides.slave = std::make_unique<SideOf<McuAxis<AuditedPort>>>(params, scene, balances.slave);
  } else {
    using World = AuditedWorld<DirectSlaveWorld>;
    sides.slave = std::make_unique<SideOf<SimulatedAxis<World>>>(
        params, World::Params{direct_slave_world_params(scene), &balances.slave}, world_numerics(scene));
  }
  return sides;
}

}  // namespace farhand
