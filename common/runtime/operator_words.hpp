// The words for an operator's acts, on a terminal and through a pipe. `stop` is accepted in upper and lower case; the
// other words only as they are written, because a word that starts motion must be intended.
#pragma once

#include <optional>
#include <string_view>

#include "common/station/states.hpp"

namespace farhand {

// Acts that can lead to a torque that was not there before.
constexpr bool needs_intent(OperatorAct act) noexcept {
  return act == OperatorAct::kEngage || act == OperatorAct::kReset || act == OperatorAct::kHome ||
         act == OperatorAct::kIdentify || act == OperatorAct::kSweep;
}

constexpr bool is_stop_letter(char c) noexcept { return c == 's' || c == 'S' || c == 'q' || c == 'Q'; }

// For --help.
inline constexpr const char* kKeysInShort =
    "Keys on a terminal: s, q, space, Esc, Enter and whatever could mean it stop at once, h holds. e (engage), r "
    "(reset),\n"
    "o (home), i (identify) and f (friction, the patient's box) act with no other key within 0.3 s before and 1 s\n"
    "after, and so do these words with Enter;\n"
    "after other text none does, until Backspace takes it back. Ctrl-Z comes to rest before the program is suspended,\n"
    "Ctrl-C before it ends. Lines of a pipe: engage, hold, stop, reset, home, identify, friction; any other line "
    "stops.";

std::optional<OperatorAct> act_of_word(std::string_view word) noexcept;

}  // namespace farhand
