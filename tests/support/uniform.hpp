// Random numbers that are the same with every standard library.
#pragma once

#include <cmath>
#include <random>

namespace farhand {

inline double uniform(std::mt19937_64& bits, double low, double high) {
  return low + (high - low) * static_cast<double>(bits() >> 11) * 0x1p-53;
}
inline double log_uniform(std::mt19937_64& bits, double low, double high) {
  return std::exp(uniform(bits, std::log(low), std::log(high)));
}

}  // namespace farhand
