#include "netem/lab/explain_sizes.hpp"

#include "common/config/station_params.hpp"
#include "common/device/mcu_axis.hpp"
#include "common/device/simulated_axis.hpp"
#include "common/link/codec.hpp"
#include "common/observer/rtob.hpp"
#include "common/runtime/side_of.hpp"
#include "common/signal/derivative.hpp"
#include "common/station/blend.hpp"
#include "common/station/limits.hpp"
#include "common/station/patient_guard.hpp"
#include "netem/lab/explain_link.hpp"
#include "netem/lab/simulation.hpp"
#include "slave/emulator_params.hpp"

namespace farhand {
namespace {

template <class Axis>
void station_sizes(const StationParams& params, std::size_t& station, std::size_t& side) {
  const OwnedStation<typename Axis::Io> made(params);
  station = made.bytes();
  side = sizeof(SideOf<Axis>) + made.bytes_beside();
}

LawSize size_of(const Architecture& laws, const LawMaker& law) {
  LawSize size{.name = laws.name, .source = laws.source, .bytes = law.bytes};
  for (const LawBlock& block : law.blocks) size.of_blocks += block.bytes;
  return size;
}

std::size_t size_of(const Block& block) {
  switch (block.id) {
    case BlockId::kVelocity:
      return sizeof(Derivative<1>);
    case BlockId::kDob:
      return sizeof(Dob<1>);
    case BlockId::kRtob:
      return sizeof(Rtob<1>);
    case BlockId::kLaw:
      return sizeof(FourChannelGains);
    case BlockId::kScale:
      return sizeof(Scale);
    case BlockId::kTorqueGate:
      return sizeof(TorqueGate<1>);
    case BlockId::kReferenceGate:
      return sizeof(ReferenceGate<1>);
    case BlockId::kBlend:
      return sizeof(Blend<1>);
    case BlockId::kEngagement:
      return sizeof(Engagement);
    case BlockId::kGuard:
      return sizeof(PatientGuard<1>);
    case BlockId::kReceiver:
      return sizeof(Receiver<1>);
    case BlockId::kCodec:
      return sizeof(PacketCodec<1>);
    case BlockId::kDelay:
      return link_bytes();
    case BlockId::kSerial:
      return 2 * sizeof(SerialLine) + 2 * sizeof(mcu::FrameDecoder);
    case BlockId::kMcu:
      return sizeof(mcu::OrthosisMcu);
    case BlockId::kHand:
      return sizeof(Hand);
    case BlockId::kWall:
      return sizeof(Wall);
    default:
      return 0;
  }
}

}  // namespace

void add_sizes(const scene::Scene& scene, Explanation& to) {
  for (Block& block : to.blocks) {
    if (block.contained && block.bytes == 0) block.bytes = size_of(block);
  }
  const Architecture& laws = architecture(scene::Architecture_Name(scene.architecture()));
  to.master_law = size_of(laws, laws.master);
  to.slave_law = size_of(laws, laws.slave);
  station_sizes<SimulatedAxis<MasterWorld>>(master_station_params(scene, kMasterSession), to.master_station_bytes,
                                            to.master_side_bytes);
  const StationParams slave = slave_station_params(scene, kSlaveSession);
  if (scene.slave().device() == scene::SERIES_ELASTIC) {
    const OwnedStation<ReferenceIo<1>> made(slave);
    to.slave_station_bytes = made.bytes();
    to.slave_side_bytes = sizeof(OrthosisOnSerial) + made.bytes_beside();
  } else {
    station_sizes<SimulatedAxis<DirectSlaveWorld>>(slave, to.slave_station_bytes, to.slave_side_bytes);
  }
}

}  // namespace farhand
