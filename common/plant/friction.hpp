// Dry friction of a plant: none, Coulomb friction with true sticking (two sliding modes, one that sticks), or a
// bristle, which is one more state.
//
//   Coulomb   torque F_c sign(v); at v = 0 the torque that keeps the axis at rest, up to F_c
//   LuGre     F = sigma_0 z + sigma_1 z' + sigma_2 v,   z' = v - |v| sigma_0 z / g(v)
//             g(v) = F_c + (F_s - F_c) exp(-(v / v_s)^2)
//
// The state of the bristle is its torque F_b = sigma_0 z (N m), which has one scale for soft and stiff bristles. LuGre
// with F_s = F_c and without sigma_1 and sigma_2 is Dahl's hysteresis: F_b tends to F_c sign(v); its slope over the
// angle is sigma_0 at F_b = 0 and twice that just after a reversal at full friction. The energy F_b^2 / (2 sigma_0) is
// stored, the power |v| F_b^2 / g is lost.
#pragma once

#include <array>
#include <cmath>
#include <optional>

namespace farhand {

enum class Friction { kNone, kCoulomb, kBristle };

class Bristle {
 public:
  struct Params {
    double F_c = 0;      // N m, sliding
    double F_s = 0;      // N m, at breakaway; not below F_c
    double v_s = 1;      // rad/s, speed scale of the transition from F_s to F_c
    double sigma_0 = 0;  // N m/rad
    double sigma_1 = 0;  // N m s/rad, of the bristle. Its work may be negative for a moment where |v| is large.
    double sigma_2 = 0;  // N m s/rad, viscous
  };
  static Params dahl(double F_c, double sigma_0) { return {F_c, F_c, 1, sigma_0, 0, 0}; }

  explicit Bristle(const Params& params) : p_(params) {}

  // z' for the speed |v| = direction v.
  double rate(double direction, double v, double F_b) const noexcept { return v - direction * v * F_b / level(v); }
  double torque(double F_b, double v, double z_rate) const noexcept {
    return F_b + p_.sigma_1 * z_rate + p_.sigma_2 * v;
  }
  // Partial derivatives of z' and of the torque.
  struct Slopes {
    double rate_v, rate_F, torque_v, torque_F;
  };
  Slopes slopes(double direction, double v, double F_b) const noexcept {
    const double g = level(v), change = direction * F_b / g;
    const double rate_v = 1.0 - change + change * v * level_slope(v) / g, rate_F = -direction * v / g;
    return {rate_v, rate_F, p_.sigma_1 * rate_v + p_.sigma_2, 1.0 + p_.sigma_1 * rate_F};
  }

  double stored_energy(double F_b) const noexcept { return 0.5 * F_b * F_b / p_.sigma_0; }
  double dissipated_power(double v, double F_b, double z_rate) const noexcept {
    return F_b * (v - z_rate) + (p_.sigma_1 * z_rate + p_.sigma_2 * v) * v;
  }
  // Velocities and torques at which it is stiffest, for motion up to the speed v: at a reversal, and fast.
  struct Point {
    double v, F_b;
  };
  std::array<Point, 2> extremes(double v) const noexcept { return {{{0.0, -p_.F_s}, {v, level(v)}}}; }
  const Params& params() const noexcept { return p_; }

 private:
  double level(double v) const noexcept {
    return p_.F_s == p_.F_c ? p_.F_c : p_.F_c + (p_.F_s - p_.F_c) * std::exp(-v * v / (p_.v_s * p_.v_s));
  }
  double level_slope(double v) const noexcept {
    return p_.F_s == p_.F_c ? 0.0 : -2.0 * v / (p_.v_s * p_.v_s) * (level(v) - p_.F_c);
  }

  Params p_;
};

// The velocity may pass 0 by this much before |v| changes its branch: rounding noise at rest then causes no event, and
// the friction is wrong by parts in 1e12.
constexpr double kRestVelocity = 1e-12;  // rad/s

}  // namespace farhand
