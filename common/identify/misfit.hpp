// What can be wrong with an axis that was identified.
#pragma once

#include <cstdint>

namespace farhand {

enum class Misfit : std::uint8_t {
  kNone,
  kTooLittleMotion,
  kUncertain,
  kAnotherPlant,
  kHeld,
  kInertia,
  kViscous,
  kCoulomb,
  kSpring
};

// As a clause.
const char* name_of(Misfit misfit) noexcept;

}  // namespace farhand
