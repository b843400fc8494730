// The patient's stop that is read from a descriptor: a pedal, a GPIO line, a pipe. Whatever comes from it is a press,
// and so is its end: a broken cable must stop. Called from the loop: never waits, allocates or locks.
#pragma once

#include <termios.h>

#include <cstdint>
#include <string>

namespace farhand {

class StopInput {
 public:
  // A path, or fd:N for a descriptor that was passed to us; empty: there is no such input. Throws std::runtime_error
  // with a sentence when it cannot be opened or has already ended, for then nobody could stop by it.
  explicit StopInput(const std::string& what);
  ~StopInput();
  StopInput(const StopInput&) = delete;
  StopInput& operator=(const StopInput&) = delete;

  // Since the last call something came, or changed; for good once the input is broken.
  bool pressed() noexcept;
  bool broken() const noexcept { return broken_; }

 private:
  // A pedal, a GPIO line's events, a pipe speak when they are pressed; a file (a GPIO line's value) is looked at.
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
  bool first_ = false;  // it was pressed before anybody asked
  char at_start_ = 0;   // first byte of a file
};

}  // namespace farhand
