#include "common/scene/patient_guard.hpp"

#include <utility>

namespace farhand {
namespace {

template <class T, std::size_t... I>
std::array<T, sizeof...(I)> alike(const T& one, std::index_sequence<I...>) noexcept {
  return {(static_cast<void>(I), one)...};
}

}  // namespace

template <int N>
PatientGuard<N>::PatientGuard(const GuardParams& params, const DriveParams& drive) noexcept
    : gate_(drive.gate),
      K_tn_(drive.model.K_tn),
      dt_s_(drive.dt_s),
      dose_(params.limits, drive.dt_s),
      shaking_limit_(params.oscillation.limit),
      joints_(alike(Joint{Plausibility(params.plausibility), Oscillation(params.oscillation)},
                    std::make_index_sequence<N>{})) {}

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
  watch(in, verdict);
  return verdict;
}

// The sensors, and what the hand is put through. Of a spring the host is told the torque that the encoders say, not
// what the spring's own sensor says (common/device/mcu_frame.hpp): that the two agree is for the MCU to judge, which
// has both 2000 times a second, and for the host to obey.
template <int N>
void PatientGuard<N>::watch(const GuardInputs<N>& in, GuardVerdict& verdict) noexcept {
  for (int i = 0; i < N; ++i) {
    auto& [plausibility, oscillation] = joints_[static_cast<std::size_t>(i)];
    if (in.valid && in.continues) {
      const double tau = in.gives_torque ? in.torque[i] : 0.0;
      const Implausible found = plausibility.step({in.local.x[i], in.local.f[i], tau}, in.periods, in.ticks);
      if (found == Implausible::kRange) verdict.fault = Reason::kOutOfRange;
      if (found == Implausible::kJump) verdict.fault = Reason::kEncoderJump;
      if (found == Implausible::kFrozen) verdict.fault = Reason::kEncoderFrozen;
    } else {
      plausibility.reset();
    }
    if (!in.valid) {
      oscillation.reset();
      continue;
    }
    oscillation.step(in.local.v[i], in.driven, in.ticks);
    verdict.gain = std::min(verdict.gain, oscillation.gain());
    verdict.shaking = std::max(verdict.shaking, oscillation.rms());
    verdict.shaken = verdict.shaken || oscillation.hold();
    if (oscillation.let_go()) verdict.fault = Reason::kShaken;
    if (oscillation.shakes()) verdict.limits |= kLimitShaking;
  }
  if (verdict.shaking >= kWarningShare * shaking_limit_) verdict.warnings |= kLimitShaking;
  if (in.device.fault == DeviceFault::kEncoder) verdict.fault = Reason::kEncoderJump;
  if (in.device.fault == DeviceFault::kSpring) verdict.fault = Reason::kSpringDisagrees;
}

template class PatientGuard<1>;

}  // namespace farhand
