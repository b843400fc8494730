// Which samples of a recording show a shaken hand: one sentence for the events when it begins, and one when it is over.
#pragma once

#include <algorithm>
#include <array>
#include <cstdio>
#include <string_view>

#include "common/observer/oscillation.hpp"
#include "common/station/tick_trace.hpp"

namespace farhand {

class ShakingNote {
 public:
  // Empty but for the ticks in which it begins and ends; valid until the next call.
  std::string_view step(double t_s, const TickTrace<1>& trace) noexcept {
    const bool shaking = (trace.limits & kLimitShaking) != 0, before = shaking_;
    shaking_ = shaking;
    if (!before) most_ = 0.0;
    most_ = std::max(most_, trace.shaking);
    if (shaking == before) return {};
    if (shaking) from_s_ = std::max(0.0, t_s - Oscillation::kWindow);
    const int size =
        shaking ? std::snprintf(text_.data(), text_.size(), "shaken: %.2f rad/s RMS, window from %.3f s", trace.shaking,
                                from_s_)
                : std::snprintf(text_.data(), text_.size(),
                                "shaken no more: at most %.2f rad/s RMS, window %.3f s to %.3f s", most_, from_s_, t_s);
    return {text_.data(), static_cast<std::size_t>(std::clamp(size, 0, static_cast<int>(text_.size()) - 1))};
  }

 private:
  std::array<char, 96> text_{};
  double from_s_ = 0.0, most_ = 0.0;
  bool shaking_ = false;
};

}  // namespace farhand
