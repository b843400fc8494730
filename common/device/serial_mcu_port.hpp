// The serial line in the form that McuAxis uses: a port that was lost is found again without help.
#pragma once

#include <string>

#include "common/device/serial_port.hpp"

namespace farhand {

class SerialMcuPort {
 public:
  explicit SerialMcuPort(const std::string& path) : port_(path) {}

  std::size_t read(std::span<std::uint8_t> bytes, double t_s) noexcept {
    // Only from the second tick after the loss: by then the station has let go, so that opening may cost it ticks.
    if (was_lost_) port_.reopen(from_seconds(t_s));
    was_lost_ = port_.lost();
    return was_lost_ ? 0 : port_.read(bytes);
  }
  bool write(std::span<const std::uint8_t> bytes, double /*t_s*/) noexcept {
    return port_.write(bytes) == bytes.size();
  }
  void drop_unsent(double /*t_s*/) noexcept { port_.drop_unsent(); }
  bool lost() noexcept { return was_lost_; }

 private:
  SerialPort port_;
  bool was_lost_ = false;
};

}  // namespace farhand
