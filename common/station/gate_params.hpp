// The settings of the gates, first and last, and of what a person is spared by, apart from the code that they set.
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

// What is taken of what a peer says (common/station/intake.hpp), in the size of this side.
struct IntakeParams {
  double torque = 3.0;        // N m
  double velocity = 4.0;      // rad/s
  double range_min = -0.349;  // rad
  double range_max = 0.349;
  double wave = 0.0;  // sqrt(W), where the integral of a wave stands in the torque's place; 0: it does not
};

// What an axis may do to the person in it while it is driven (common/station/person_bound.hpp).
struct PersonBoundParams {
  double speed = std::numeric_limits<double>::infinity();  // rad/s
  double power = std::numeric_limits<double>::infinity();  // W, given to the person
  bool free = false;                                       // what the person does himself is left alone, however fast
};

}  // namespace farhand
