#include "common/analysis/orthosis_loop.hpp"

#include <limits>

#include "common/integrate/eigenvalues.hpp"
#include "common/integrate/lu.hpp"
#include "common/integrate/matrix_exponential.hpp"

namespace farhand {
namespace {

enum Index { kX, kV, kMotor, kMotorSpeed, kFiltered, kDob, kRtob };

}  // namespace

OrthosisMotion::OrthosisMotion(const OrthosisLoop& p) {
  using Row = Eigen::Matrix<double, 1, kStates>;
  const auto unit = [](Index i) { return Row::Unit(i); };
  const double a_v = p.g_v * p.dt / (1.0 + p.g_v * p.dt), a = p.g * p.dt / (1.0 + p.g * p.dt);

  // Each line is a row over the state; what the MCU computes within a loop.
  const Row x = unit(kX);
  const Row v = a_v / p.dt * (x - unit(kFiltered));
  const Row filtered = unit(kFiltered) + a_v * (x - unit(kFiltered));
  const Row tau_spring = p.spring * (unit(kMotor) - x);
  const Row inertia = p.J_n * p.g * v;
  const Row dob = unit(kDob) + a * (tau_spring + inertia - unit(kDob));
  const Row rtob = unit(kRtob) + a * (tau_spring - p.viscous * v + inertia - unit(kRtob));
  force_ = rtob - inertia;
  const Row tau_ref = p.J_n * (-p.K_p * x - p.K_d * v - p.K_f * force_) + dob - inertia;
  const Row u = v + p.spring_gain * (tau_ref - tau_spring);

  // The plant while u is held.
  SquareMatrix<double, 4> flow{};
  flow[kX][kV] = 1.0;
  flow[kV] = {-(p.spring + p.axis.k) / p.axis.J, -p.axis.b / p.axis.J, p.spring / p.axis.J, 0.0};
  flow[kMotor][kMotorSpeed] = 1.0;
  flow[kMotorSpeed][kMotorSpeed] = -p.motor_rate;
  const auto held = respond<double, 4>(flow, {}, 0.0, p.dt);

  next_.setZero();
  input_.setZero();
  for (int i = 0; i < 4; ++i) {
    const auto row = static_cast<std::size_t>(i);
    for (int j = 0; j < 4; ++j) next_(i, j) = held.D[row][static_cast<std::size_t>(j)] + (i == j ? 1.0 : 0.0);
    const double of_u = held.Psi[row][kMotorSpeed] * p.motor_rate;
    next_.row(i) += of_u * u;
    input_[i] = of_u * p.spring_gain * p.J_n;
  }
  next_.row(kFiltered) = filtered;
  next_.row(kDob) = dob;
  next_.row(kRtob) = rtob;
}

double OrthosisMotion::spectral_radius() const {
  // Column by column is row by row of the transposed, whose eigenvalues are the same.
  return std::abs(fastest_eigenvalue({next_.data(), kStates * kStates}, kStates));
}

OrthosisMotion::Answer OrthosisMotion::to_acceleration(std::complex<double> z) const {
  // (z - A) s = b with real and imaginary part of s one after the other; what is factored is I - J.
  constexpr std::size_t n = kStates;
  StateMatrix<2 * n> J{};
  std::array<double, 2 * n> state{};
  for (std::size_t i = 0; i < n; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    for (std::size_t k = 0; k < n; ++k) J[i][k] = J[n + i][n + k] = next_(row, static_cast<Eigen::Index>(k));
    J[i][i] = J[n + i][n + i] += 1.0 - z.real();
    J[i][n + i] = z.imag();
    J[n + i][i] = -z.imag();
    state[i] = input_[row];
  }
  Lu<2 * n> lu;
  if (!lu.factor(1.0, J)) state.fill(std::numeric_limits<double>::quiet_NaN());
  lu.solve(state);
  Answer answer{{state[kX], state[n + kX]}, 0.0};
  for (std::size_t i = 0; i < n; ++i) {
    answer.f += force_[static_cast<Eigen::Index>(i)] * std::complex<double>(state[i], state[n + i]);
  }
  return answer;
}

}  // namespace farhand
