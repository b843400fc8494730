#include "common/analysis/orthosis_loop.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <unsupported/Eigen/MatrixFunctions>

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
  Eigen::Matrix<double, 5, 5> flow = Eigen::Matrix<double, 5, 5>::Zero();
  flow(kX, kV) = 1.0;
  flow(kV, kX) = -(p.spring + p.axis.k) / p.axis.J;
  flow(kV, kV) = -p.axis.b / p.axis.J;
  flow(kV, kMotor) = p.spring / p.axis.J;
  flow(kMotor, kMotorSpeed) = 1.0;
  flow(kMotorSpeed, kMotorSpeed) = -p.motor_rate;
  flow(kMotorSpeed, 4) = p.motor_rate;
  const Eigen::Matrix<double, 5, 5> held = (flow * p.dt).exp();

  next_.setZero();
  next_.topLeftCorner<4, 4>() = held.topLeftCorner<4, 4>();
  next_.topRows<4>() += held.topRightCorner<4, 1>() * u;
  next_.row(kFiltered) = filtered;
  next_.row(kDob) = dob;
  next_.row(kRtob) = rtob;
  input_.setZero();
  input_.head<4>() = held.topRightCorner<4, 1>() * p.spring_gain * p.J_n;
}

double OrthosisMotion::spectral_radius() const { return next_.eigenvalues().cwiseAbs().maxCoeff(); }

OrthosisMotion::Answer OrthosisMotion::to_acceleration(std::complex<double> z) const {
  using Complex = std::complex<double>;
  Eigen::Matrix<Complex, kStates, kStates> open = -next_.cast<Complex>();
  open.diagonal().array() += z;
  const Eigen::Matrix<Complex, kStates, 1> state = open.partialPivLu().solve(input_.cast<Complex>().eval());
  return {state[kX], (force_.cast<Complex>() * state)(0)};
}

}  // namespace farhand
