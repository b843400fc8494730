// The meaning of a terminal's keys, one byte at a time. A missed stop is worse than a false one, and an act that starts
// motion needs intent:
//
//   s q space Esc Enter, in either case, and every control key but Backspace and Ctrl-U   stop, at once
//   h                                                                                     hold, at once
//   e r o i f   on an empty line, after 0.3 s and before 1 s without a key      engage, reset, home, identify, friction
//   engage reset home identify friction   and Enter, with 0.3 s of silence before and after                  the same
//
// Text stays in the line, and no letter counts after it, however slowly it is typed. Only Enter and Esc, which stop,
// and Backspace and Ctrl-U empty the line. The silence after a letter is a second and not 0.3 s, because people who
// type slowly need up to that for the next letter of "emil" or "rudi". Escape sequences (arrows, brackets around a
// paste, answers of the terminal) begin with Esc and are not text.
//
// Silence is time in which the input was read and found empty. Time in which the program did not read does not count,
// so that a stalled program does not take the letters of a word for single keys.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "common/runtime/input_remark.hpp"
#include "common/signal/joints.hpp"

namespace farhand {

class TypedKeys {
 public:
  static constexpr Nanoseconds kBefore = 300 * kMillisecond;  // without a key, before a letter and around a word
  static constexpr Nanoseconds kAfterLetter = kSecond;

  // The next byte.
  std::optional<OperatorAct> take(char c) noexcept;
  // The input was empty at this time. Never returns kStop.
  std::optional<OperatorAct> quiet(Nanoseconds now) noexcept;
  // Other programs have read from the terminal: earlier input does not count.
  void forget() noexcept;

  // The remark since the last call.
  InputRemark take_remark() noexcept;

 private:
  enum class Escape : std::uint8_t { kNone, kStarted, kCsi, kLinuxCsi, kSs3 };

  bool goes_on_with_escape(char c) noexcept;
  std::optional<OperatorAct> enter() noexcept;
  std::optional<OperatorAct> text(char c, bool after_silence) noexcept;
  void take_back() noexcept;
  void clear() noexcept { size_ = 0; }
  std::string_view line() const noexcept { return {line_.data(), size_}; }

  std::array<char, 200> line_{};  // a longer one is no word, and is taken back from its 200th letter on
  std::size_t size_ = 0;
  bool alone_ = false;  // there was silence before the line
  Escape escape_ = Escape::kNone;
  OperatorAct awaits_ = OperatorAct::kNone;  // silence, to be done
  bool word_ = false;                        // that was a word with Enter
  std::optional<Nanoseconds> quiet_since_;
  Nanoseconds quiet_ = 0;
  bool told_ = false;  // that the line is not understood
  InputRemark remark_;
};

}  // namespace farhand
