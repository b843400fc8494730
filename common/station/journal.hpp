// The sentences of a recording about a station: acts of the operator, changes of state with their reasons, shaking of
// the hand, decisions of the law. Each sentence is worded only here, for programs and lab.
#pragma once

#include <algorithm>
#include <array>
#include <cstdio>
#include <string_view>
#include <utility>

#include "common/observer/oscillation.hpp"
#include "common/station/tick_trace.hpp"

namespace farhand {

class Journal {
 public:
  // After each tick. said: wording of the operator's act; null: the act's name is used; empty: the act was recorded
  // before. why: reason of the present state. told(sentence) is called for each sentence, which is valid only within
  // the call.
  template <class Told>
  void step(double t_s, const TickTrace<1>& trace, OperatorAct act, const char* said, const char* why,
            const Told& told) noexcept {
    if (act != OperatorAct::kNone && said == nullptr) told(worded("operator: %s", name_of(act)));
    if (said != nullptr && *said != '\0') told(std::string_view(said));
    if (!std::exchange(begun_, true) || trace.state != state_) {
      told(worded("%s: %s", name_of(trace.state), why));
      if (trace.reason == Reason::kAnotherAxis) told(std::string_view(name_of(trace.misfit)));
      if (state_ == StationState::kSweeping && trace.swept.values > 0)
        told(worded("friction: %.4f N m, spread %.4f N m, slope %.3f N m/rad over the angle", trace.swept.F_c,
                    trace.swept.spread, trace.swept.slope));
    }
    state_ = trace.state;
    shaking(t_s, trace, told);
    if (std::exchange(decisions_, trace.law.decisions) != decisions_ && trace.law.remark != nullptr)
      told(fit(trace.law.remark(trace.law.own, text_)));
  }

 private:
  template <class... Values>
  std::string_view worded(const char* format, const Values&... values) noexcept {
    return fit(std::snprintf(text_.data(), text_.size(), format, values...));
  }
  // snprintf returns the length of the whole text, even if only a part of it fits.
  std::string_view fit(int length) const noexcept {
    return {text_.data(), std::min(static_cast<std::size_t>(std::max(length, 0)), text_.size() - 1)};
  }

  // Writes when shaking begins and when it has ended.
  template <class Told>
  void shaking(double t_s, const TickTrace<1>& trace, const Told& told) noexcept {
    const bool shaking = (trace.limits & kLimitShaking) != 0, before = std::exchange(shaking_, shaking);
    if (!before) most_ = 0.0;
    most_ = std::max(most_, trace.shaking);
    if (shaking == before) return;
    if (shaking) {
      from_s_ = std::max(0.0, t_s - Oscillation::kWindow);
      told(worded("shaken: %.2f rad/s RMS, window from %.3f s", trace.shaking, from_s_));
    } else {
      told(worded("shaken no more: at most %.2f rad/s RMS, window %.3f s to %.3f s", most_, from_s_, t_s));
    }
  }

  std::array<char, 160> text_{};
  StationState state_ = StationState::kOff;
  double from_s_ = 0.0, most_ = 0.0;  // of the shaking
  int decisions_ = 0;
  bool begun_ = false, shaking_ = false;
};

}  // namespace farhand
