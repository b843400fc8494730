#include "common/analysis/held_axis.hpp"

#include <Eigen/Core>
#include <unsupported/Eigen/MatrixFunctions>

namespace farhand {

HeldAxis::HeldAxis(const LoadedAxis& axis, double dt_s) {
  Eigen::Matrix3d flow = Eigen::Matrix3d::Zero();  // of (x, v, tau); tau stands still
  flow(0, 1) = 1.0;
  flow.row(1) << -axis.k / axis.J, -axis.b / axis.J, 1.0 / axis.J;
  const Eigen::Matrix3d held = (flow * dt_s).exp();
  for (std::size_t i = 0; i < 2; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    phi[i] = {held(row, 0), held(row, 1)};
    gamma[i] = held(row, 2);
  }
}

Polynomial HeldAxis::numerator() const { return {phi[0][1] * gamma[1] - phi[1][1] * gamma[0], gamma[0]}; }

Polynomial HeldAxis::denominator() const {
  return {phi[0][0] * phi[1][1] - phi[0][1] * phi[1][0], -(phi[0][0] + phi[1][1]), 1.0};
}

}  // namespace farhand
