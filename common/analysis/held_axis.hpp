// Exact motion of an axis within one period while its torque is held (zero-order hold):
//
//   J x'' + b x' + k x = tau   ->   (x, v)(n+1) = phi (x, v)(n) + gamma tau(n)
#pragma once

#include <array>

#include "common/analysis/polynomial.hpp"

namespace farhand {

struct LoadedAxis {
  double J = 4e-3;  // kg m2, above 0
  double b = 0;     // N m s/rad
  double k = 0;     // N m/rad
};

struct HeldAxis {
  std::array<std::array<double, 2>, 2> phi;
  std::array<double, 2> gamma;

  HeldAxis(const LoadedAxis& axis, double dt_s);

  // Transfer function from tau(n) to x(n): numerator() / denominator().
  Polynomial numerator() const;
  Polynomial denominator() const;
};

}  // namespace farhand
