// The terminal in a mode that gives each key at once, without echo and without flow control, so that Ctrl-S is a key as
// well. Signals stay (Ctrl-C, Ctrl-\, Ctrl-Z). Its old mode is restored whenever another program may use it: after the
// program, however that ends, while it is suspended, and in the background. One object at a time per process.
#pragma once

#include <termios.h>

#include <cstdint>

namespace farhand {

class KeyTerminal {
 public:
  // A descriptor that is not a terminal stays untouched.
  explicit KeyTerminal(int fd);
  ~KeyTerminal();
  KeyTerminal(const KeyTerminal&) = delete;
  KeyTerminal& operator=(const KeyTerminal&) = delete;

  bool is_terminal() const noexcept { return terminal_; }
  // Sets the mode for keys again if the program is in the foreground and another program (a shell, stty) has changed
  // it. Returns false if another program reads the terminal.
  bool tend() noexcept;
  bool in_foreground() const noexcept;
  // Descriptor to read from: an open file of our own, whose reads do not block even if another program is faster.
  int reader() const noexcept { return own_ >= 0 ? own_ : fd_; }

 private:
  int fd_;
  int own_ = -1;
  bool terminal_;
};

// Restores the old mode, for good or until tend() may set it again. For signal handlers, which must not wait for the
// loop, because the shell does not wait either.
enum class GivenBack : std::uint8_t { kNo, kWhileSuspended, kForGood };
void give_key_terminal_back(GivenBack how) noexcept;
GivenBack key_terminal_is_given_back() noexcept;
void let_key_terminal_be_taken() noexcept;

}  // namespace farhand
