// The words in which an operator asks for something, on a terminal and through a pipe. A stop is understood in any
// case; the others as they are written, because what lets something move is to be meant.
#pragma once

#include <optional>
#include <string_view>

#include "common/station/states.hpp"

namespace farhand {

// What can end in a torque that was not there.
constexpr bool needs_intent(OperatorAct act) noexcept {
  return act == OperatorAct::kEngage || act == OperatorAct::kReset || act == OperatorAct::kHome ||
         act == OperatorAct::kIdentify;
}

constexpr bool is_stop_letter(char c) noexcept { return c == 's' || c == 'S' || c == 'q' || c == 'Q'; }

// For --help.
inline constexpr const char* kKeysInShort =
    "Keys on a terminal: s, q, space, Esc, Enter and whatever could mean it stop at once, h holds. e (engage), r "
    "(reset),\n"
    "o (home) and i (identify) act with no other key within 0.3 s before and 1 s after, and so do these words with "
    "Enter;\n"
    "after other text none does, until Backspace takes it back. Ctrl-Z comes to rest before the program is suspended,\n"
    "Ctrl-C before it ends. Lines of a pipe: engage, hold, stop, reset, home, identify; any other line stops.";

std::optional<OperatorAct> act_of_word(std::string_view word) noexcept;

}  // namespace farhand
