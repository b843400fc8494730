// The operator's acts from standard input: whole lines (engage, hold, stop, reset, home, identify) from a pipe or file,
// single keys (e, h, s, r, o, i, and q for stop) from a terminal. Nothing moves at start, so this is how a session
// comes alive. Never blocks, never spins on a closed input, and an input that ends does not end the session.
#pragma once

#include <termios.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "common/scene/states.hpp"

namespace farhand {

class OperatorInput {
 public:
  // So many acts may wait for their ticks; more are dropped, and counted as not understood.
  static constexpr std::size_t kWaiting = 32;

  // A terminal is set to give keys at once and without echo; it is restored at destruction. Ctrl-C stays a signal.
  explicit OperatorInput(int fd = 0);
  ~OperatorInput();
  OperatorInput(const OperatorInput&) = delete;
  OperatorInput& operator=(const OperatorInput&) = delete;

  // The next act, if one is there; to be called once per tick. A stop overtakes what was asked before it and has not
  // been done yet.
  std::optional<OperatorAct> poll() noexcept;

  bool keys() const noexcept { return terminal_; }
  bool closed() const noexcept { return closed_; }
  std::uint64_t not_understood() const noexcept { return not_understood_; }

 private:
  void fill() noexcept;
  std::optional<OperatorAct> take(char c) noexcept;
  std::optional<OperatorAct> finish_line() noexcept;
  void line_up(std::optional<OperatorAct> act) noexcept;

  int fd_;
  bool terminal_ = false;
  bool closed_ = false;
  termios before_{};
  std::array<OperatorAct, kWaiting> acts_{};  // not yet done
  std::size_t acts_waiting_ = 0;
  std::array<char, 16> line_{};  // longer than the longest word; what does not fit is not understood
  std::size_t line_size_ = 0;
  bool line_too_long_ = false;
  std::uint64_t not_understood_ = 0;
};

}  // namespace farhand
