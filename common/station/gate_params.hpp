// The settings of the first and the last gate, and of the bound that protects a person, apart from their code.
#pragma once

#include <limits>

namespace farhand {

struct GateParams {
  double torque = 3.0;          // N m
  double torque_rate = 3000.0;  // N m/s
  double velocity = 4.0;        // rad/s, of a reference
  double range_min = -0.349;    // rad
  double range_max = 0.349;
  double acceleration = std::numeric_limits<double>::infinity();  // rad/s2, asked for
};

// Limits on the motion that a peer sends (common/station/intake.hpp), scaled to this side.
struct IntakeParams {
  double torque = 3.0;        // N m
  double velocity = 4.0;      // rad/s
  double range_min = -0.349;  // rad
  double range_max = 0.349;
  double wave = 0.0;  // sqrt(W), where the integral of a wave stands in the torque's place; 0: it does not
};

// Limits on the effect of a driven axis on the person in it (common/station/person_bound.hpp).
struct PersonBoundParams {
  double speed = std::numeric_limits<double>::infinity();  // rad/s
  double power = std::numeric_limits<double>::infinity();  // W, given to the person
  bool free = false;                                       // the person's own motion is not slowed, however fast
};

}  // namespace farhand
