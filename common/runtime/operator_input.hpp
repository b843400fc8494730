// The operator's acts from standard input: keys from a terminal (typed_keys.hpp), words in lines from anything else
// (word_lines.hpp). Nothing moves at start, so this is how a session comes alive, and how it is stopped. Never blocks,
// never spins on a closed input. A pipe that ends ends nothing; a terminal that hangs up stops.
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
  // So many acts may wait for their ticks; more are dropped, unless it is a stop.
  static constexpr std::size_t kWaiting = 32;

  explicit OperatorInput(int fd = 0) : fd_(fd), terminal_(fd) {}

  // The next act, if one is there; to be called once per tick, with the time on any clock that never goes back. A stop
  // overtakes what was asked before it and has not been done yet.
  std::optional<OperatorAct> poll(Nanoseconds now) noexcept;
  // Instead of it while there is no session: keys are heard, and only a stop is kept. Lines stay in their pipe.
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
