#include "common/station/patient_guard.hpp"

namespace farhand {
template <int N>
PatientGuard<N>::PatientGuard(const GuardParams& params, const DriveParams& drive) noexcept
    : gate_(drive.gate), K_tn_(drive.model.K_tn), dt_s_(drive.dt_s), dose_(params.limits, drive.dt_s), watch_(params) {}

template <int N>
GuardVerdict PatientGuard<N>::step(const GuardInputs<N>& in) noexcept {
  // Several motors are judged by the one that carries most.
  const double current = in.device.motor_current.value_or(in.torque.abs().maxCoeff() / K_tn_);
  const LimitVerdict dose = dose_.step({.power_w = (in.local.f * in.local.v).sum(),
                                        .current_a = current,
                                        .surface_c = in.device.surface_temperature,
                                        .driven = in.driven,
                                        .engaged = in.engaged,
                                        .ticks = in.ticks});
  GuardVerdict verdict;
  verdict.hold = dose.hold;
  verdict.gain = dose.gain;
  verdict.limits = dose.limits;
  verdict.warnings = dose.warnings;

  const auto warn = [&](bool near, LimitBit bit) {
    if (near) verdict.warnings |= bit;
  };
  const double middle = 0.5 * (gate_.range_min + gate_.range_max), half = 0.5 * (gate_.range_max - gate_.range_min);
  warn((in.local.x - middle).abs().maxCoeff() >= kWarningShare * half, kLimitRange);
  const double asked = in.driven ? in.reference.v.abs().maxCoeff() : 0.0;
  warn(in.local.v.abs().maxCoeff() >= kWarningShare * gate_.velocity || asked >= kWarningShare * gate_.velocity,
       kLimitVelocity);
  warn(in.torque.abs().maxCoeff() >= kWarningShare * gate_.torque, kLimitTorque);
  const double change = (in.reference.v - v_reference_).abs().maxCoeff();
  warn(in.driven && change >= kWarningShare * gate_.acceleration * dt_s_ * in.ticks, kLimitAcceleration);
  v_reference_ = in.reference.v;
  watch_.step(in, verdict);
  return verdict;
}

template class PatientGuard<1>;

}  // namespace farhand
