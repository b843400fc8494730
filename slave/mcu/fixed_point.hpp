// Scaled integers of the MCU core: the units, and a multiplication that rounds to nearest and saturates. It multiplies
// 32 by 16 bits in two halves, because a 64-bit product takes an 8-bit MCU several times as long.
#pragma once

#include <stdint.h>

#ifdef __AVR__
#include "slave/mcu/avr/product.hpp"
#define FARHAND_WITH_ITS_GAIN __attribute__((always_inline))  // then the shift is by a constant
#else
#define FARHAND_WITH_ITS_GAIN
#endif

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

// |value| < 2^15.
inline int32_t narrow_product(int32_t value, uint16_t factor) {
  return static_cast<int32_t>(static_cast<int16_t>(value)) * factor;
}

inline int32_t clamp(int32_t value, int32_t lowest, int32_t highest) {
  return value < lowest ? lowest : value > highest ? highest : value;
}

#ifndef __AVR__
// value * mantissa = high 2^16 + low exactly, 0 <= low < 2^16.
struct Product {
  int32_t high;
  uint16_t low;
};
inline Product product(int32_t value, uint16_t mantissa) {
  const uint32_t below = static_cast<uint32_t>(value & 0xFFFF) * mantissa;
  return {(value >> 16) * static_cast<int32_t>(mantissa) + static_cast<int32_t>(below >> 16),
          static_cast<uint16_t>(below & 0xFFFF)};
}
inline void twice(Product& p) {
  p.high = p.high * 2 + (p.low >> 15);
  p.low = static_cast<uint16_t>(p.low << 1);
}
#endif

// value * gain to the nearest unit, saturated at +-kLargest. |value| <= 2^30, so that no product leaves 32 bits.
FARHAND_WITH_ITS_GAIN inline int32_t times(int32_t value, Gain gain) {
  static_assert(kLargest == int32_t(16) << 24, "the highest byte alone tells what is too large");
  const auto highest_byte = [](int32_t wide) { return static_cast<int8_t>(wide >> 24); };
  Product p = product(value, gain.mantissa);
  if (gain.right > 16) {
    // The omitted part of `low` is less than a unit of `high` and changes the result by less than half a unit.
    uint8_t right = static_cast<uint8_t>(gain.right - 17);
    for (; right >= 8; right = static_cast<uint8_t>(right - 8)) p.high >>= 8;
    p.high = ((p.high >> right) + 1) >> 1;
    if (highest_byte(p.high) >= 16) return kLargest;
    return highest_byte(p.high) < -16 ? -kLargest : p.high;
  }
  for (uint8_t left = static_cast<uint8_t>(16 - gain.right);; --left) {
    if (highest_byte(p.high) >= 16) return kLargest;
    if (highest_byte(p.high) < -16) return -kLargest;
    if (left == 0) return p.high + (p.low >> 15);
    twice(p);
  }
}

}  // namespace mcu
}  // namespace farhand
