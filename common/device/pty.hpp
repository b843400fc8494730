// The other end of the serial line without a board: a pseudo terminal that the MCU emulator holds. Its host finds it
// through a symbolic link at a path of the user's choice.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace farhand {

class Pty {
 public:
  // Replaces a symbolic link that an earlier run left behind, and nothing else. Throws std::runtime_error with a
  // sentence.
  explicit Pty(const std::string& link);
  ~Pty();
  Pty(const Pty&) = delete;
  Pty& operator=(const Pty&) = delete;

  // These never wait: they return 0 without data, or without room (a host that does not read loses bytes).
  std::size_t write(std::span<const std::uint8_t> bytes) noexcept;
  std::size_t read(std::span<std::uint8_t> buffer) noexcept;

  const std::string& device() const noexcept { return device_; }
  int native_handle() const noexcept { return master_; }

 private:
  int master_ = -1;
  int host_side_ = -1;  // held open, so that settings stay and a host may come and go as with a real board
  std::string device_;
  std::string link_;
};

}  // namespace farhand
