// A torque-controlled motor with the parts that are rigidly fixed to it: the device of the therapist (Daud 2011, 5.2.1:
// 3 N m brushless motor, prosthetic hand on its axis, encoder of 20000 per revolution, about 40 degrees of motion), and
// the ideal device of the patient.
//
//   J a = tau - resistance(x, v) - friction - f,   resistance = viscous v - gravity sin(x + gravity_angle) + stops
//
// The angle of the centre of mass counts from the upright position, from which weight pulls the axis away: it acts as
// + gravity sin(...), and its compensation is - gravity sin(...). The current amplifier (5 kHz) is fast enough to be
// left out.
#pragma once

#include <cmath>
#include <numbers>
#include <optional>

#include "common/plant/encoder.hpp"
#include "common/plant/friction.hpp"
#include "common/plant/stops.hpp"

namespace farhand {

class MotorAxis {
 public:
  struct Params {
    double J = 0.004;
    double viscous = 0.002;
    double gravity = 0;  // weight times lever, N m
    double gravity_angle = 0;
    double encoder_counts_per_rev = 20000;  // 0: ideal
    double stop_min = -0.349;
    double stop_max = 0.349;
    double coulomb = 0;  // N m; 0: none
    std::optional<Bristle::Params> bristle = std::nullopt;

    Friction friction() const noexcept {
      return bristle ? Friction::kBristle : coulomb > 0 ? Friction::kCoulomb : Friction::kNone;
    }
  };

  explicit MotorAxis(const Params& params) : p_(params), stops_(params.stop_min, params.stop_max, params.J) {}

  Mode mode_at(double x, double v, double a) const noexcept { return stops_.mode_at(x, v, a); }
  double resistance(Mode mode, double x, double v) const noexcept {
    const double weight = p_.gravity > 0 ? p_.gravity * std::sin(x + p_.gravity_angle) : 0.0;
    return p_.viscous * v - weight + stops_.reaction(mode, x, v);
  }
  double stiffness(Mode mode, double x) const noexcept {
    const double weight = p_.gravity > 0 ? p_.gravity * std::cos(x + p_.gravity_angle) : 0.0;
    return stops_.stiffness(mode) - weight;
  }
  double damping(Mode mode) const noexcept { return p_.viscous + stops_.damping(mode); }
  double stored_energy(double x, double v) const noexcept {
    return 0.5 * p_.J * v * v + p_.gravity * std::cos(x + p_.gravity_angle) + stops_.stored_energy(x);
  }
  double dissipated_power(Mode mode, double x, double v) const noexcept {
    return p_.viscous * v * v + stops_.dissipated_power(mode, x, v);
  }
  double encoder(double x) const noexcept { return quantised(x, p_.encoder_counts_per_rev); }
  double hanging() const noexcept { return std::numbers::pi - p_.gravity_angle; }  // where gravity pulls back most
  double J() const noexcept { return p_.J; }
  double gravity() const noexcept { return p_.gravity; }
  const Stops<>& stops() const noexcept { return stops_; }

 private:
  Params p_;
  Stops<> stops_;
};

}  // namespace farhand
