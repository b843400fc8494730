// The table of all architectures, one row each. No other file knows all of them.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/law/row.hpp"

namespace farhand {

// K: of this side; dt_s: control period.
using MakeLaw = std::unique_ptr<Law<1>> (*)(const LawParams& p, const FourChannelGains& K, double dt_s);

struct LawMaker {
  MakeLaw make;
  std::size_t bytes;                   // size of the object that it makes
  std::span<const LawSignal> signals;  // that the law records, at most kMostLawSignals
  std::span<const LawBlock> blocks;    // of which the law consists, beside four channels
};

struct Architecture {
  std::string_view name;    // as in a scene
  std::string_view source;  // publication that it comes from
  LawMaker master, slave;
};

std::span<const Architecture> architectures() noexcept;
// Finds an architecture by its name; the first returns null if there is none, the second throws std::invalid_argument.
const Architecture* find_architecture(std::string_view name) noexcept;
const Architecture& architecture(std::string_view name);

const LawBlock* block_of(const LawMaker& law, std::string_view name) noexcept;  // or none
// Whether a block of either side reads it. setting: path in a scene.
bool reads(const Architecture& laws, std::string_view setting) noexcept;
// Of either side; or none.
const LawSignal* signal_of(const Architecture& laws, std::string_view name) noexcept;
std::vector<std::string> names_of(std::span<const LawSignal> signals);

}  // namespace farhand
