#include "netem/lab/emulated_slave.hpp"

#include "common/config/station_params.hpp"
#include "common/device/mcu_axis.hpp"
#include "common/runtime/side_of.hpp"
#include "netem/lab/emulated_port.hpp"

namespace farhand {
std::unique_ptr<Side> make_emulated_slave(const scene::Scene& scene, std::uint32_t session) {
  return std::make_unique<SideOf<McuAxis<EmulatedPort>>>(slave_station_params(scene, session), scene);
}

}  // namespace farhand
