// A stiff object in the patient's box: resists motion away from 0 beyond its angle, never pulls.
#pragma once

#include "common/plant/one_sided_spring.hpp"

namespace farhand {

class Wall {
 public:
  struct Params {
    double stiffness = 1000;
    double damping = 0.4;
    double at = 0.1;  // its sign decides the side; 0 counts as positive
  };

  explicit Wall(const Params& params)
      : params_(params), spring_{params.stiffness, params.damping, params.at, params.at < 0 ? -1.0 : 1.0} {}

  double reaction(double x, double v) const noexcept { return spring_.reaction(x, v); }
  double stored_energy(double x) const noexcept { return spring_.stored_energy(x); }
  double dissipated_power(double x, double v) const noexcept { return spring_.dissipated_power(x, v); }
  const Params& params() const noexcept { return params_; }

 private:
  Params params_;
  OneSidedSpring spring_;
};

}  // namespace farhand
