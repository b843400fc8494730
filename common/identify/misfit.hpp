// The ways in which an identified axis can differ from the scene.
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
