// The words in which an operator asks for something, on a terminal and through a pipe. A stop is understood in any
// case; the others as they are written, because what lets something move is to be meant.
#pragma once

#include <optional>
#include <string_view>

#include "common/scene/states.hpp"

namespace farhand {

// What can end in a torque that was not there.
constexpr bool needs_intent(OperatorAct act) noexcept {
  return act == OperatorAct::kEngage || act == OperatorAct::kReset || act == OperatorAct::kHome ||
         act == OperatorAct::kIdentify;
}

constexpr bool is_stop_letter(char c) noexcept { return c == 's' || c == 'S' || c == 'q' || c == 'Q'; }

std::optional<OperatorAct> act_of_word(std::string_view word) noexcept;

}  // namespace farhand
