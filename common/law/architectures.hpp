// Every architecture, one row each. Nothing else knows them all.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string_view>

#include "common/law/law.hpp"
#include "common/law/params.hpp"

namespace farhand {

// K: of this side; dt_s: control period.
using MakeLaw = std::unique_ptr<Law<1>> (*)(const LawParams& p, const FourChannelGains& K, double dt_s);

struct LawMaker {
  MakeLaw make;
  std::size_t bytes;  // of what it makes
};

struct Architecture {
  std::string_view name;    // as in a scene
  std::string_view source;  // where it is from
  LawMaker master, slave;
};

std::span<const Architecture> architectures() noexcept;
// Throws std::invalid_argument if there is none of this name.
const Architecture& architecture(std::string_view name);

}  // namespace farhand
