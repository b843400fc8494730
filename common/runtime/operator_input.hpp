// The operator's acts from standard input: keys from a terminal (typed_keys.hpp), words in lines from any other input
// (word_lines.hpp). Nothing moves at start; these acts start a session and stop it. Never blocks, and never spins on a
// closed input. The end of a pipe has no effect; a terminal that hangs up stops the station.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "common/exchange/latest.hpp"
#include "common/runtime/key_terminal.hpp"
#include "common/runtime/typed_keys.hpp"
#include "common/runtime/word_lines.hpp"

namespace farhand {

class OperatorInput {
 public:
  // Number of acts that may wait for their ticks; further ones are dropped, except stops.
  static constexpr std::size_t kWaiting = 32;

  explicit OperatorInput(int fd = 0) : fd_(fd), terminal_(fd) {}

  // The next act, if there is one; to be called once per tick, with the time on any clock that never goes back. A stop
  // overtakes earlier acts that have not been done yet.
  std::optional<OperatorAct> poll(Nanoseconds now) noexcept;
  // Called instead of poll() while there is no session: keys are read, and only a stop is kept. Lines stay in their
  // pipe.
  void wait(Nanoseconds now) noexcept;

  bool keys() const noexcept { return terminal_.is_terminal(); }
  bool closed() const noexcept { return closed_; }

  // The newest remark since the last call; from one other thread.
  bool read_remark(InputRemark& remark) noexcept { return remarks_.read(remark); }

 private:
  enum class Terminal : std::uint8_t { kHere, kSuspending, kElsewhere, kGone };

  bool may_read() noexcept;
  void fill(Nanoseconds now) noexcept;
  void close_it() noexcept;
  void line_up(std::optional<OperatorAct> act) noexcept;
  void say(const InputRemark& remark) noexcept;

  int fd_;
  KeyTerminal terminal_;
  TypedKeys typed_;
  WordLines lines_;
  bool closed_ = false;
  std::array<OperatorAct, kWaiting> acts_{};  // not yet done
  std::size_t acts_waiting_ = 0;
  std::uint32_t polls_ = 0;
  Terminal where_ = Terminal::kHere;  // whom the terminal serves
  Latest<InputRemark> remarks_;
};

}  // namespace farhand
