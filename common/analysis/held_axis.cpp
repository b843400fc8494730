#include "common/analysis/held_axis.hpp"

#include "common/integrate/matrix_exponential.hpp"

namespace farhand {

HeldAxis::HeldAxis(const LoadedAxis& axis, double dt_s) {
  const auto held = respond<double, 2>({{{0.0, 1.0}, {-axis.k / axis.J, -axis.b / axis.J}}}, {}, 0.0, dt_s);
  for (std::size_t i = 0; i < 2; ++i) {
    phi[i] = held.D[i];
    phi[i][i] += 1.0;
    gamma[i] = held.Psi[i][1] / axis.J;
  }
}

Polynomial HeldAxis::numerator() const { return {phi[0][1] * gamma[1] - phi[1][1] * gamma[0], gamma[0]}; }

Polynomial HeldAxis::denominator() const {
  return {phi[0][0] * phi[1][1] - phi[0][1] * phi[1][0], -(phi[0][0] + phi[1][1]), 1.0};
}

}  // namespace farhand
