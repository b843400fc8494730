// Which scene on which device: the one place where the architectures of a scene file become types.
#include "common/config/station_params.hpp"
#include "common/config/world_params.hpp"
#include "common/device/mcu_axis.hpp"
#include "common/device/serial_mcu_port.hpp"
#include "common/device/simulated_axis.hpp"
#include "common/runtime/side_of.hpp"

namespace farhand {
namespace {

template <Axis A, class... AxisArgs>
std::unique_ptr<Side> make_master(const scene::Scene& scene, std::uint32_t session, const AxisArgs&... axis_args) {
  const StationParams params = master_station_params(scene, session);
  if (scene.architecture() == scene::FOUR_CHANNEL_CDOB)
    return std::make_unique<SideOf<FourChannelCdob, A>>(params, axis_args...);
  if (scene.architecture() == scene::FOUR_CHANNEL_CDOB_SDCV) {
    return std::make_unique<SideOf<FourChannelCdobSdcv, A>>(params, axis_args...);
  }
  return std::make_unique<SideOf<FourChannel, A>>(params, axis_args...);
}

}  // namespace

std::unique_ptr<Side> make_simulated_master(const scene::Scene& scene, std::uint32_t session) {
  return make_master<SimulatedAxis<MasterWorld>>(scene, session, master_world_params(scene), world_numerics(scene));
}

std::unique_ptr<Side> make_serial_master(const scene::Scene& scene, std::uint32_t session,
                                         const std::string& serial_port) {
  return make_master<McuAxis<SerialMcuPort>>(scene, session, serial_port);
}

std::unique_ptr<Side> make_simulated_slave(const scene::Scene& scene, std::uint32_t session) {
  return std::make_unique<SideOf<FourChannel, SimulatedAxis<DirectSlaveWorld>>>(
      slave_station_params(scene, session), direct_slave_world_params(scene), world_numerics(scene));
}

std::unique_ptr<Side> make_serial_slave(const scene::Scene& scene, std::uint32_t session,
                                        const std::string& serial_port) {
  return std::make_unique<SideOf<FourChannel, McuAxis<SerialMcuPort>>>(slave_station_params(scene, session),
                                                                       serial_port);
}

}  // namespace farhand
