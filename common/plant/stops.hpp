// Mechanical stops of a device: two stiff one-sided springs. They are part of the device; their torque does not count
// as the person's.
#pragma once

#include <array>
#include <cmath>

#include "common/plant/one_sided_spring.hpp"
#include "common/plant/plant_mode.hpp"

namespace farhand {

// 3 N m, the largest torque of the devices, press 1 mrad into a stop. This is far less than matters to a hand, and soft
// enough that RK4 resolves it at 50 us (omega h = 0.04 at 4e-3 kg m2).
constexpr double kStopStiffness = 3000.0;

// Also used for the ends of the range of a series spring; the bits select the modes.
template <Mode kAtMin = kAtStopMin, Mode kAtMax = kAtStopMax>
class Stops {
 public:
  // Half of critical damping for the inertia J that hits it, so that a device comes to rest after one bounce.
  Stops(double min, double max, double J)
      : min_{kStopStiffness, std::sqrt(kStopStiffness * J), min, -1.0},
        max_{kStopStiffness, std::sqrt(kStopStiffness * J), max, 1.0} {}

  Mode mode_at(double x, double v, double a = 0) const noexcept {
    return (min_.pushes(x, v, a) ? kAtMin : 0u) | (max_.pushes(x, v, a) ? kAtMax : 0u);
  }
  template <class T>
  T reaction(Mode mode, T x, T v) const noexcept {
    return min_.reaction((mode & kAtMin) != 0, x, v) + max_.reaction((mode & kAtMax) != 0, x, v);
  }
  double stiffness(Mode mode) const noexcept {
    return ((mode & kAtMin) != 0 ? min_.stiffness : 0.0) + ((mode & kAtMax) != 0 ? max_.stiffness : 0.0);
  }
  double damping(Mode mode) const noexcept {
    return ((mode & kAtMin) != 0 ? min_.damping : 0.0) + ((mode & kAtMax) != 0 ? max_.damping : 0.0);
  }
  std::array<double, 2> guards(Mode mode, double x, double v) const noexcept {
    return {min_.guard((mode & kAtMin) != 0, x, v), max_.guard((mode & kAtMax) != 0, x, v)};
  }
  template <class T, std::size_t S>
  std::array<AffineGuard<T, S>, 2> guard_forms(Mode mode) const noexcept {
    return {min_.guard_form<T, S>((mode & kAtMin) != 0), max_.guard_form<T, S>((mode & kAtMax) != 0)};
  }
  FreeRange free_range() const noexcept { return min_.free_range(max_.free_range({})); }
  // Of guards()[guard].
  static constexpr Mode bit(std::size_t guard) noexcept { return guard == 0 ? kAtMin : kAtMax; }

  double stored_energy(double x) const noexcept { return min_.stored_energy(x) + max_.stored_energy(x); }
  double dissipated_power(Mode mode, double x, double v) const noexcept {
    return min_.dissipated_power((mode & kAtMin) != 0, x, v) + max_.dissipated_power((mode & kAtMax) != 0, x, v);
  }

 private:
  OneSidedSpring min_, max_;
};

}  // namespace farhand
