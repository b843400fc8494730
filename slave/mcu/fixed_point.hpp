// Scaled integers of the MCU core: the units, and a multiplication that rounds to nearest and saturates. 32 by 16 bit
// in two halves, because an 8-bit MCU pays for a 64-bit product several times what it pays for this one.
#pragma once

#include <stdint.h>

namespace farhand {
namespace mcu {

// One unit is 2^-26 rad (15 nrad), 2^-20 rad/s or 2^-24 N m (60 nN m). One encoder count of 0.3 mrad is 21083 angle
// units, so that rounding stays four decades below the sensors. Every quantity is kept within +-2^28 units: +-4 rad,
// +-256 rad/s, +-16 N m; sums of up to four of them fit an int32, differences of two (+-2^29) fit the multiplication
// below.
constexpr uint8_t kAngleBits = 26;
constexpr uint8_t kVelocityBits = 20;
constexpr uint8_t kTorqueBits = 24;
constexpr int32_t kLargest = int32_t(1) << 28;

// mantissa / 2^right: 16 significant bits (2^15 <= mantissa < 2^16, or 0), so a coefficient is off by at most 2^-16 of
// itself.
struct Gain {
  uint16_t mantissa;
  uint8_t right;  // 0 to 47
};

inline int32_t clamp(int32_t value, int32_t lowest, int32_t highest) {
  return value < lowest ? lowest : value > highest ? highest : value;
}

// value * gain to the nearest unit, saturated at +-kLargest. |value| <= 2^30.
inline int32_t times(int32_t value, Gain gain) {
  // value * mantissa = high 2^16 + low exactly, 0 <= low < 2^16; |value >> 16| <= 2^14, so no product leaves 32 bits.
  const uint32_t product = static_cast<uint32_t>(value & 0xFFFF) * gain.mantissa;
  const int32_t high = (value >> 16) * static_cast<int32_t>(gain.mantissa) + static_cast<int32_t>(product >> 16);
  if (gain.right > 16) {
    // |high| <= 2^30 and half <= 2^30. What is left of low is under a unit of high and changes the result by less than
    // half of one.
    const uint8_t right = static_cast<uint8_t>(gain.right - 16);
    return clamp((high + (int32_t(1) << (right - 1))) >> right, -kLargest, kLargest);
  }
  const uint8_t left = static_cast<uint8_t>(16 - gain.right);
  if (high >= (kLargest >> left)) return kLargest;
  if (high < -(kLargest >> left)) return -kLargest;
  const uint32_t low = product & 0xFFFF;
  const uint32_t half = gain.right == 0 ? 0 : uint32_t(1) << (gain.right - 1);
  return high * (int32_t(1) << left) + static_cast<int32_t>((low + half) >> gain.right);
}

}  // namespace mcu
}  // namespace farhand
