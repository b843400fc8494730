// The line to the orthosis MCU: 115200 baud 8N1, called from the loop. libserialport opens and configures it. This
// class adds what the library lacks: it detects that the cable was pulled, locks the port, and does not reset the
// board. Every call except `reopen` is bounded and neither uses the heap nor waits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "common/signal/joints.hpp"

struct sp_port;

namespace farhand {

class SerialPort {
 public:
  struct Counters {
    std::uint64_t bytes_written = 0;
    std::uint64_t bytes_read = 0;
    std::uint64_t bytes_not_written = 0;  // the output buffer was full; a cut frame fails its CRC at the other end
    std::uint64_t losses = 0;
    std::uint64_t reopened = 0;
  };

  // Throws std::runtime_error with a sentence that names the remedy. A pseudo terminal is given by a symbolic link to
  // it, and the program must run with libfarhand_pty_modem.so preloaded (the library asks for modem lines that no
  // pseudo terminal has).
  explicit SerialPort(std::string path);
  ~SerialPort();
  SerialPort(const SerialPort&) = delete;
  SerialPort& operator=(const SerialPort&) = delete;

  // Number of bytes written or read; 0 if there is no room, no byte is waiting, or the port is lost.
  std::size_t write(std::span<const std::uint8_t> bytes) noexcept;
  std::size_t read(std::span<std::uint8_t> buffer) noexcept;

  // Discards bytes that were written and have not left yet, so that the next bytes do not queue behind them.
  void drop_unsent() noexcept;

  // True if the device has gone. Asks the kernel, so that one call per tick detects a pulled cable within the tick.
  // Stays true until `reopen`.
  bool lost() noexcept;

  // Tries the path again, at most every 250 ms; true when the port is there again (then the handshake starts over).
  // Only for a station that is already in its safe state: opening a USB adapter takes milliseconds of ioctl and some
  // heap, so ticks are missed while it works. It cannot wait for a carrier or for output to drain (O_NONBLOCK; buffers
  // are discarded before the old handle is closed).
  bool reopen(Nanoseconds now) noexcept;

  const Counters& counters() const noexcept { return counters_; }
  int native_handle() const noexcept { return fd_; }

 private:
  void open();
  void close() noexcept;
  void release() noexcept;
  short ready(short events) noexcept;
  [[noreturn]] void refuse(int error, const char* doing) const;

  std::string path_;
  sp_port* port_ = nullptr;
  int fd_ = -1;
  bool lost_ = false;
  Nanoseconds next_attempt_ns_ = 0;
  Counters counters_;
};

}  // namespace farhand
