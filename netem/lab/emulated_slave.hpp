// The patient's side with the orthosis and its MCU in virtual time.
#pragma once

#include "common/runtime/side.hpp"

namespace farhand {

std::unique_ptr<Side> make_emulated_slave(const scene::Scene& scene, std::uint32_t session);

}  // namespace farhand
