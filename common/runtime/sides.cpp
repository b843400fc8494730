// Which station on which device.
#include "common/config/effect.hpp"
#include "common/config/station_params.hpp"
#include "common/config/world_params.hpp"
#include "common/device/mcu_axis.hpp"
#include "common/device/serial_mcu_port.hpp"
#include "common/device/simulated_axis.hpp"
#include "common/runtime/side_of.hpp"

namespace farhand {

std::unique_ptr<Side> make_simulated_master(const scene::Scene& scene, std::uint32_t session) {
  return std::make_unique<SideOf<SimulatedAxis<MasterWorld>>>(master_station_params(scene, session),
                                                              master_world_params(scene), world_numerics(scene));
}

std::unique_ptr<Side> make_serial_master(const scene::Scene& scene, std::uint32_t session,
                                         const std::string& serial_port) {
  refuse_direct_drive_of_master(scene);
  return std::make_unique<SideOf<McuAxis<SerialMcuPort>>>(master_station_params(scene, session), serial_port);
}

std::unique_ptr<Side> make_simulated_slave(const scene::Scene& scene, std::uint32_t session) {
  return std::make_unique<SideOf<SimulatedAxis<DirectSlaveWorld>>>(
      slave_station_params(scene, session), direct_slave_world_params(scene), world_numerics(scene));
}

std::unique_ptr<Side> make_serial_slave(const scene::Scene& scene, std::uint32_t session,
                                        const std::string& serial_port) {
  return std::make_unique<SideOf<McuAxis<SerialMcuPort>>>(slave_station_params(scene, session), serial_port);
}

}  // namespace farhand
