#include "common/station/axis_watch.hpp"

#include <algorithm>
#include <utility>

namespace farhand {
namespace {

template <class T, std::size_t... I>
std::array<T, sizeof...(I)> alike(const T& one, std::index_sequence<I...>) noexcept {
  return {(static_cast<void>(I), one)...};
}

}  // namespace

template <int N>
AxisWatch<N>::AxisWatch(const GuardParams& params) noexcept
    : shaking_limit_(params.oscillation.limit),
      joints_(alike(Joint{Plausibility(params.plausibility), Oscillation(params.oscillation)},
                    std::make_index_sequence<N>{})) {}

// The sensors, and what the hand is put through. Of a spring the host is told the torque that the encoders say, not
// what the spring's own sensor says (common/device/mcu_frame.hpp): that the two agree is for the MCU to judge, which
// has both 2000 times a second, and for the host to obey.
template <int N>
void AxisWatch<N>::step(const GuardInputs<N>& in, GuardVerdict& verdict) noexcept {
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

template class AxisWatch<1>;

}  // namespace farhand
