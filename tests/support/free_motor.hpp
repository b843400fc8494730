// A motor that nothing holds, and a slave's world on it.
#pragma once

#include <numbers>

#include "common/plant/world.hpp"

namespace farhand {

inline constexpr double kPi = std::numbers::pi;

// A rotor far from its stops, without friction, with an ideal encoder.
inline MotorAxis::Params free_motor() {
  MotorAxis::Params p;
  p.viscous = 0;
  p.encoder_counts_per_rev = 0;
  p.stop_min = -7;
  p.stop_max = 7;
  return p;
}

inline WorldNumerics by_steps(double step) {
  WorldNumerics numerics;
  numerics.settings.max_step = step;
  return numerics;
}

inline DirectSlaveWorld direct(const MotorAxis::Params& motor, const Environment::Params& environment = {},
                               double start = 0, double step = 50e-6) {
  return DirectSlaveWorld({.motor = motor, .load = environment, .start = start}, by_steps(step));
}

}  // namespace farhand
