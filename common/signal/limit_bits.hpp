// Names of the limits, one bit each.
#pragma once

#include <cstdint>

namespace farhand {

// Limits that act right now, as bits (sent to the peer, recorded, shown to the therapist).
enum LimitBit : std::uint32_t {
  kLimitTorque = 1u << 0,     // torque clipped to the limit of the axis
  kLimitRate = 1u << 1,       // change per tick clipped
  kLimitRange = 1u << 2,      // outward torque or reference cut at the end of the range
  kLimitVelocity = 1u << 3,   // reference velocity clipped
  kLimitNotFinite = 1u << 4,  // a NaN or Inf was replaced by the safe value
  kLimitDevice = 1u << 5,     // the device itself (MCU) reports an active limit
};
inline constexpr std::uint32_t kAllLimits = (1u << 6) - 1;  // the codec rejects any other bit

}  // namespace farhand
