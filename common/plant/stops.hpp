// Mechanical stops of a device: two stiff one-sided springs, part of the device and so not felt as the person.
#pragma once

#include <cmath>

#include "common/plant/one_sided_spring.hpp"

namespace farhand {

// 3 N m, the largest torque of the devices, press 1 mrad into a stop: far less than matters to a hand, and soft enough
// that RK4 resolves it at 50 us (omega h = 0.04 at 4e-3 kg m2).
constexpr double kStopStiffness = 3000.0;

class Stops {
 public:
  // Half of critical damping for the inertia J that hits it, so that a device comes to rest after one bounce.
  Stops(double min, double max, double J)
      : min_{kStopStiffness, std::sqrt(kStopStiffness * J), min, -1.0},
        max_{kStopStiffness, std::sqrt(kStopStiffness * J), max, 1.0} {}

  double reaction(double x, double v) const noexcept { return min_.reaction(x, v) + max_.reaction(x, v); }
  double stored_energy(double x) const noexcept { return min_.stored_energy(x) + max_.stored_energy(x); }
  double dissipated_power(double x, double v) const noexcept {
    return min_.dissipated_power(x, v) + max_.dissipated_power(x, v);
  }
  double damping() const noexcept { return max_.damping; }

 private:
  OneSidedSpring min_, max_;
};

}  // namespace farhand
