// The product of fixed_point.hpp on the ATmega, in assembly: 50 cycles instead of the compiler's 160, and a loop has
// twenty products. The bits are those of the PC: the test on the simulated chip compares every command.
#pragma once

#include <stdint.h>

namespace farhand {
namespace mcu {

// value * mantissa = high 2^16 + low exactly.
struct Product {
  int32_t high;
  uint16_t low;
};

inline Product product(int32_t value, uint16_t mantissa) {
  Product p;
  asm("mul   %A2, %A3  \n\t"
      "movw  %A1, r0   \n\t"
      "mul   %C2, %A3  \n\t"
      "movw  %A0, r0   \n\t"
      "mulsu %D2, %B3  \n\t"
      "movw  %C0, r0   \n\t"
      "mul   %B2, %B3  \n\t"
      "add   %A0, r0   \n\t"
      "adc   %B0, r1   \n\t"
      "clr   r0        \n\t"
      "adc   %C0, r0   \n\t"
      "adc   %D0, r0   \n\t"
      "mul   %A2, %B3  \n\t"
      "add   %B1, r0   \n\t"
      "adc   %A0, r1   \n\t"
      "clr   r0        \n\t"
      "adc   %B0, r0   \n\t"
      "adc   %C0, r0   \n\t"
      "adc   %D0, r0   \n\t"
      "mul   %B2, %A3  \n\t"
      "add   %B1, r0   \n\t"
      "adc   %A0, r1   \n\t"
      "clr   r0        \n\t"
      "adc   %B0, r0   \n\t"
      "adc   %C0, r0   \n\t"
      "adc   %D0, r0   \n\t"
      "mul   %C2, %B3  \n\t"
      "add   %B0, r0   \n\t"
      "adc   %C0, r1   \n\t"
      "clr   r0        \n\t"
      "adc   %D0, r0   \n\t"
      "mulsu %D2, %A3  \n\t"
      "sbc   %D0, r0   \n\t"  // mulsu leaves the sign of its product in the carry; r0 itself comes back at once
      "add   %D0, r0   \n\t"
      "add   %B0, r0   \n\t"
      "adc   %C0, r1   \n\t"
      "clr   r1        \n\t"
      "adc   %D0, r1   \n\t"
      : "=&r"(p.high), "=&r"(p.low)
      : "a"(value), "a"(mantissa));
  return p;
}
inline void twice(Product& p) {
  asm("lsl %A1 \n\t"
      "rol %B1 \n\t"
      "rol %A0 \n\t"
      "rol %B0 \n\t"
      "rol %C0 \n\t"
      "rol %D0 \n\t"
      : "+r"(p.high), "+r"(p.low));
}

}  // namespace mcu
}  // namespace farhand
