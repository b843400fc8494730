// The velocity of an axis for its law, and for the guards that protect a person. An encoder with few counts leaves the
// law a slower cut-off, because each count becomes a step of g_v * count in the velocity that is sent to the peer. A
// guard must see a fast motion early and bears the noise, so its own cut-off never falls with the law's.
#pragma once

#include <algorithm>
#include <optional>

#include "common/signal/derivative.hpp"

namespace farhand {

template <int N>
class AxisSpeed {
 public:
  // g_v: of the law.
  AxisSpeed(Cutoff g_v, double dt_s) : guard_cutoff_(Cutoff::rad_s(std::max(g_v.rad_s(), kGuard))), law_(g_v, dt_s) {
    if (g_v.rad_s() < kGuard) guard_.emplace(guard_cutoff_, dt_s);
  }

  const Joints<N>& step(const Joints<N>& x) noexcept {
    if (guard_) guard_->step(x);
    return law_.step(x);
  }
  void reset(const Joints<N>& x) noexcept {
    if (guard_) guard_->reset(x);
    law_.reset(x);
  }
  const Joints<N>& across(const Joints<N>& x, int ticks) noexcept {
    if (guard_) guard_->across(x, ticks);
    return law_.across(x, ticks);
  }

  const Joints<N>& value() const noexcept { return law_.value(); }
  Joints<N> last() const noexcept { return law_.last(); }
  const Joints<N>& for_guards() const noexcept { return guard_ ? guard_->value() : law_.value(); }
  Cutoff guard_cutoff() const noexcept { return guard_cutoff_; }
  bool two() const noexcept { return guard_.has_value(); }

 private:
  static constexpr double kGuard = 500.0;  // rad/s: 2 ms late, for which the limits at the person are laid out
  Cutoff guard_cutoff_;
  Derivative<N> law_;
  std::optional<Derivative<N>> guard_;  // only where the law's cut-off is slower
};

}  // namespace farhand
