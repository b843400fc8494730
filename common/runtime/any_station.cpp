#include "common/runtime/any_station.hpp"

#include <type_traits>

#include "common/scene/station.hpp"

namespace farhand {
namespace {

template <class Io, class S>
class StationOf final : public AnyStation<Io> {
 public:
  explicit StationOf(const StationParams& params)
      : identifying_(params.engagement.identification
                         ? std::make_unique<Identifying>(params.identifying, params.scene.drive)
                         : nullptr),
        station_(params, identifying_.get()) {}

  Receipt receive(const Packet<1>& packet, Nanoseconds now) noexcept override { return station_.receive(packet, now); }
  typename AnyStation<Io>::Output tick(Nanoseconds now, const typename Io::Sensed& sensed, OperatorAct act,
                                       int ticks) noexcept override {
    const auto out = station_.tick(now, sensed, act, ticks);
    return {out.command, out.packet};
  }
  const TickTrace<1>& trace() const noexcept override { return station_.trace(); }
  const Receiver<1>& receiver() const noexcept override { return station_.receiver(); }
  bool carries_energy() const noexcept override { return Station<S>::kKeepsAccount; }
  std::size_t bytes() const noexcept override { return sizeof(station_) + (identifying_ ? sizeof(*identifying_) : 0); }

 private:
  std::unique_ptr<Identifying> identifying_;
  Station<S> station_;
};

}  // namespace

template <class Io>
std::unique_ptr<AnyStation<Io>> make_station(const StationParams& params) {
  using Drive = std::conditional_t<std::is_same_v<Io, DirectIo<1>>, DirectDrive<1>, ReferenceDrive<1>>;
  switch (params.architecture) {
    case Architecture::kCdob:
      return std::make_unique<StationOf<Io, FourChannelCdob<Drive>>>(params);
    case Architecture::kCdobSdcv:
      return std::make_unique<StationOf<Io, FourChannelCdobSdcv<Drive>>>(params);
    case Architecture::kMediated:
      return std::make_unique<StationOf<Io, FourChannelMediated<Drive>>>(params);
    case Architecture::kTwoChannelMaster:
      return std::make_unique<StationOf<Io, TwoChannelMaster<Drive>>>(params);
    case Architecture::kTwoChannelSlave:
      return std::make_unique<StationOf<Io, TwoChannelSlave<Drive>>>(params);
    case Architecture::kWaveMaster:
      return std::make_unique<StationOf<Io, WaveMaster<Drive>>>(params);
    case Architecture::kWaveSlave:
      return std::make_unique<StationOf<Io, WaveSlave<Drive>>>(params);
    case Architecture::kAuto:
      return std::make_unique<StationOf<Io, FourChannelAuto<Drive>>>(params);
    case Architecture::kTank:
      return std::make_unique<StationOf<Io, FourChannelTank<Drive>>>(params);
    case Architecture::kPassiveMaster:
      return std::make_unique<StationOf<Io, PassiveMaster<Drive>>>(params);
    case Architecture::kPassiveSlave:
      return std::make_unique<StationOf<Io, PassiveSlave<Drive>>>(params);
    case Architecture::kFourChannel:
      break;
  }
  return std::make_unique<StationOf<Io, FourChannel<Drive>>>(params);
}

template std::unique_ptr<AnyStation<DirectIo<1>>> make_station(const StationParams&);
template std::unique_ptr<AnyStation<ReferenceIo<1>>> make_station(const StationParams&);

}  // namespace farhand
