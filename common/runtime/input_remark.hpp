// The program's answer to operator input on which it does not act at once. It is stored as numbers, so that the loop
// can hand it to the thread that prints it (operator_notices.hpp).
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "common/station/states.hpp"

namespace farhand {

struct InputRemark {
  enum class Kind : std::uint8_t {
    kNone,
    kAwaitsSilence,  // a letter was pressed, and acts unless another key follows
    kUnfinished,     // the line holds text in which no letter counts
    kNotUnderstood,  // the line ended, was not a word, and stopped
    kTogether,       // a word that starts motion came together with other input, and stopped
    kSuspending,
    kBackground,
    kClosed
  };
  static constexpr std::size_t kShown = 24;

  Kind kind = Kind::kNone;
  OperatorAct act = OperatorAct::kNone;  // of kAwaitsSilence
  std::array<char, kShown + 4> text{};   // of the line, printable and ended by 0
};

InputRemark remark_on(InputRemark::Kind kind, std::string_view line) noexcept;
std::string sentence_of(const InputRemark& remark);

}  // namespace farhand
