// The therapist's arm on the device: a spring and damper to where the hand is intended to be, and an inertia that moves
// with the device.
//
//   torque on the device = K_h (x_int - x) + B_h (v_int - v) - J_h a
//
// The last term is why the arm's inertia enters the equation of motion twice: it adds to the J of the device, and it is
// part of what crosses between hand and device.
#pragma once

#include "common/plant/intended_motion.hpp"
#include "common/plant/power_flow.hpp"

namespace farhand {

// How firmly the device is held: N m/rad, N m s/rad.
struct Grip {
  double K_h, B_h;
};
constexpr Grip kLightGrip{0.5, 0.01};
constexpr Grip kNormalGrip{3, 0.06};
constexpr Grip kFirmGrip{10, 0.15};

class Therapist {
 public:
  struct Params {
    double K_h = kNormalGrip.K_h;
    double B_h = kNormalGrip.B_h;
    double J_h = 0.001;
    std::vector<Movement> intended = {};
  };

  explicit Therapist(const Params& params, double start = 0)
      : K_h_(params.K_h), B_h_(params.B_h), J_h_(params.J_h), motion_(params.intended, start) {}

  // What spring and damper exert on the device, in its positive direction.
  double pull(double t, double x, double v) const noexcept {
    const IntendedMotion::Point intended = motion_.at(t);
    return K_h_ * (intended.x - x) + B_h_ * (intended.v - v);
  }
  double stored_energy(double t, double x, double v) const noexcept {
    const double stretch = motion_.at(t).x - x;
    return 0.5 * J_h_ * v * v + 0.5 * K_h_ * stretch * stretch;
  }
  PowerFlow power(double t, double x, double v) const noexcept {
    const double v_int = motion_.at(t).v;
    return {pull(t, x, v) * v_int, B_h_ * (v_int - v) * (v_int - v)};
  }
  double K_h() const noexcept { return K_h_; }
  double B_h() const noexcept { return B_h_; }
  double J_h() const noexcept { return J_h_; }
  const IntendedMotion& motion() const noexcept { return motion_; }

 private:
  double K_h_, B_h_, J_h_;
  IntendedMotion motion_;
};

}  // namespace farhand
