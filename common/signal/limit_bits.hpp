// Names of the limits, one bit each.
#pragma once

#include <cstdint>

namespace farhand {

// Limits that act right now, as bits (sent to the peer, recorded, shown to the therapist). The numbers are on the wire
// and in recordings: never reuse one. What each does: common/station/patient_guard.hpp.
enum LimitBit : std::uint32_t {
  kLimitTorque = 1u << 0,        // torque clipped to the limit of the axis
  kLimitRate = 1u << 1,          // change per tick clipped
  kLimitRange = 1u << 2,         // outward torque or reference cut at the end of the range
  kLimitVelocity = 1u << 3,      // reference velocity, or torque that speeds the axis up, clipped
  kLimitNotFinite = 1u << 4,     // a NaN or Inf was replaced by the safe value
  kLimitDevice = 1u << 5,        // the device itself (MCU) reports an active limit
  kLimitAcceleration = 1u << 6,  // acceleration asked for clipped
  kLimitPower = 1u << 7,         // power delivered to the hand: the network's share is lowered
  kLimitEnergy = 1u << 8,        // energy delivered within a minute: holds
  kLimitHeat = 1u << 9,          // warmth of the motor: holds until it has cooled
  kLimitSession = 1u << 10,      // time of the session: holds until the patient's side begins another
  kLimitShaking = 1u << 11,      // the hand is shaken: the network's share is lowered, then holds until it is calm
};
inline constexpr std::uint32_t kLimits = (1u << 12) - 1;

// The warning that a limit is near (from 0.9 of it on) is the same bit in the upper half.
inline constexpr int kWarningShift = 16;
inline constexpr double kWarningShare = 0.9;
inline constexpr std::uint32_t kAllLimits = kLimits | kLimits << kWarningShift;

// What a side says of a gap of the network, beside its limits (common/station/resumption.hpp).
enum GapBit : std::uint32_t {
  kGapHeld = 1u << 12,  // holds because a side heard nothing, and nothing else has happened
  kGapOver = 1u << 13,  // goes on after it, as soon as the peer does, or does so now
};
inline constexpr std::uint32_t kGapBits = kGapHeld | kGapOver;
inline constexpr std::uint32_t kPacketBits = kAllLimits | kGapBits;  // the codec rejects any other bit

struct NamedLimit {
  LimitBit bit;
  const char* name;
};
inline constexpr NamedLimit kLimitNames[] = {{kLimitTorque, "torque"},
                                             {kLimitRate, "rate"},
                                             {kLimitRange, "range"},
                                             {kLimitVelocity, "velocity"},
                                             {kLimitNotFinite, "not finite"},
                                             {kLimitDevice, "device"},
                                             {kLimitAcceleration, "acceleration"},
                                             {kLimitPower, "power"},
                                             {kLimitEnergy, "energy"},
                                             {kLimitHeat, "heat"},
                                             {kLimitSession, "session time"},
                                             {kLimitShaking, "shaking"}};

}  // namespace farhand
