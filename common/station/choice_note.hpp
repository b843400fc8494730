// What AUTO has chosen and why: one sentence for the events whenever it does.
#pragma once

#include <algorithm>
#include <array>
#include <cstdio>
#include <string_view>

#include "common/station/tick_trace.hpp"

namespace farhand {

class ChoiceNote {
 public:
  // Empty but for the ticks in which something was chosen; valid until the next call.
  std::string_view step(const TickTrace<1>& trace) noexcept {
    const Chosen& now = trace.law.chosen;
    if (now.choice == choice_) return {};
    choice_ = now.choice;
    const char* name = choice_ == Choice::kMediated ? "model-mediated" : "plain four channels";
    const int size = std::snprintf(text_.data(), text_.size(), "auto: %s, for a round trip of %.1f ms and %.1f %% loss",
                                   name, 1e3 * now.round_trip, 100 * now.loss);
    return {text_.data(), static_cast<std::size_t>(std::clamp(size, 0, static_cast<int>(text_.size()) - 1))};
  }

 private:
  std::array<char, 96> text_{};
  Choice choice_ = Choice::kNone;
};

}  // namespace farhand
