// The terminal that gives keys: each at once, without echo and without flow control, so that Ctrl-S is a key as well.
// Signals stay (Ctrl-C, Ctrl-\, Ctrl-Z). It is as before whenever somebody else may use it: after the program, however
// that ends, while it is suspended, and in the background. One at a time per process.
#pragma once

#include <termios.h>

#include <cstdint>

namespace farhand {

class KeyTerminal {
 public:
  // What is no terminal stays untouched.
  explicit KeyTerminal(int fd);
  ~KeyTerminal();
  KeyTerminal(const KeyTerminal&) = delete;
  KeyTerminal& operator=(const KeyTerminal&) = delete;

  bool is_terminal() const noexcept { return terminal_; }
  // Takes the terminal for keys whenever it is in the foreground and somebody (a shell, stty) has set it otherwise.
  // False where another program reads it.
  bool tend() noexcept;
  bool in_foreground() const noexcept;
  // To read from: an open file of our own, whose reads do not block even where another program is faster.
  int reader() const noexcept { return own_ >= 0 ? own_ : fd_; }

 private:
  int fd_;
  int own_ = -1;
  bool terminal_;
};

// Gives it back as it was before, and leaves it so: for good, or until it may be taken again. For signal handlers,
// which must not wait for the loop: the shell does not either.
enum class GivenBack : std::uint8_t { kNo, kWhileSuspended, kForGood };
void give_key_terminal_back(GivenBack how) noexcept;
GivenBack key_terminal_is_given_back() noexcept;
void let_key_terminal_be_taken() noexcept;

}  // namespace farhand
