// The patient's stop that is read from a descriptor: a pedal, a GPIO line, a pipe. Any input is a press, and so is the
// end of the input, because a broken cable must stop. Called from the loop: never waits, allocates or locks.
#pragma once

#include <termios.h>

#include <cstdint>
#include <string>

namespace farhand {

class StopInput {
 public:
  // A path, or fd:N for a descriptor that was passed to the program; empty: there is no such input. Throws
  // std::runtime_error with a sentence if it cannot be opened or has already ended, because it could then stop nothing.
  explicit StopInput(const std::string& what);
  ~StopInput();
  StopInput(const StopInput&) = delete;
  StopInput& operator=(const StopInput&) = delete;

  // True if input came, or the value changed, since the last call; true for ever once the input is broken.
  bool pressed() noexcept;
  bool broken() const noexcept { return broken_; }

 private:
  // A pedal, the events of a GPIO line and a pipe send data when pressed; a file (the value of a GPIO line) is polled.
  enum class Kind : std::uint8_t { kNone, kEvents, kFile };

  void take_each_byte();
  bool came() noexcept;
  bool changed() noexcept;

  Kind kind_ = Kind::kNone;
  int fd_ = -1;
  bool ours_ = false;  // opened here, to be closed here
  bool line_ = false;  // a terminal line: a serial port
  termios before_{};
  bool broken_ = false;
  bool first_ = false;  // it was pressed before the first call
  char at_start_ = 0;   // first byte of a file
};

}  // namespace farhand
