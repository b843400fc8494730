// Friction of the push-pull cables, as a hysteresis (Dahl): the cause of the loops in Daud 2011, figures 5.15 and 5.18.
//
//   dF/dt = sigma (v - |v| F / F_c)
//
// F resists positive motion when positive and tends to F_c sign(v). Its slope dF/dx is sigma where F = 0, and 2 sigma
// just after the motion turns round at full friction. F^2 / (2 sigma) is stored, |v| F^2 / F_c is lost: the loop never
// gives energy. With F_c = 0 the torque stays 0.
#pragma once

#include <cmath>

namespace farhand {

class TendonFriction {
 public:
  struct Params {
    double F_c = 0;     // N m
    double sigma = 20;  // N m/rad
  };

  explicit TendonFriction(const Params& params) : p_(params) {}

  double derivative(double F, double v) const noexcept {
    return p_.F_c > 0 ? p_.sigma * (v - std::fabs(v) * F / p_.F_c) : 0.0;
  }
  double stored_energy(double F) const noexcept { return p_.F_c > 0 ? 0.5 * F * F / p_.sigma : 0.0; }
  double dissipated_power(double F, double v) const noexcept {
    return p_.F_c > 0 ? std::fabs(v) * F * F / p_.F_c : 0.0;
  }
  double stiffness() const noexcept { return p_.F_c > 0 ? 2.0 * p_.sigma : 0.0; }
  // How fast F settles at speed v, 1/s.
  double rate(double v) const noexcept { return p_.F_c > 0 ? p_.sigma * std::fabs(v) / p_.F_c : 0.0; }

 private:
  Params p_;
};

}  // namespace farhand
