// One direction of a serial cable in virtual time: bytes leave one after the other and arrive after the latency of the
// adapter.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "common/device/mcu_frame.hpp"
#include "common/signal/joints.hpp"

namespace farhand {

class SerialLine {
 public:
  // one_way_s: from sending a frame of ten bytes to the arrival of its last byte. At 115200 baud the bytes alone take
  // 868 us; a shorter one_way_s is a line that is as much faster.
  explicit SerialLine(double one_way_s) {
    const Nanoseconds one_way = from_seconds(one_way_s);
    const Nanoseconds whole_frame = one_way / mcu::kWireBytes;
    byte_time_ = whole_frame < kByteTime ? whole_frame : kByteTime;
    latency_ = one_way - byte_time_ * mcu::kWireBytes;
  }

  // Queues behind bytes that are still leaving. Bytes that do not fit the buffer are lost, as at a full driver buffer.
  void send(const std::uint8_t* bytes, std::size_t count, Nanoseconds now) noexcept {
    if (free_at_ < now) free_at_ = now;
    for (std::size_t i = 0; i < count && waiting_ < ring_.size(); ++i) {
      free_at_ += byte_time_;
      ring_[(first_ + waiting_++) % ring_.size()] = {free_at_ + latency_, bytes[i]};
    }
  }

  // Drops the bytes that have not begun to leave.
  void drop_unsent(Nanoseconds now) noexcept {
    while (waiting_ > 0) {
      const Nanoseconds left = ring_[(first_ + waiting_ - 1) % ring_.size()].arrives - latency_;
      if (left - byte_time_ < now) break;
      free_at_ = left - byte_time_;
      --waiting_;
    }
  }

  // The next byte, whether it has arrived or not.
  bool take(std::uint8_t& byte) noexcept { return receive(std::numeric_limits<Nanoseconds>::max(), byte); }
  std::size_t waiting() const noexcept { return waiting_; }

  // The next byte that has arrived by now.
  bool receive(Nanoseconds now, std::uint8_t& byte) noexcept {
    if (waiting_ == 0 || ring_[first_].arrives > now) return false;
    byte = ring_[first_].value;
    first_ = (first_ + 1) % ring_.size();
    --waiting_;
    return true;
  }

 private:
  static constexpr Nanoseconds kByteTime = 10 * kSecond / 115200;  // 8N1: ten bits

  struct Byte {
    Nanoseconds arrives;
    std::uint8_t value;
  };
  Nanoseconds byte_time_, latency_, free_at_ = 0;
  std::array<Byte, 2048> ring_{};
  std::size_t first_ = 0, waiting_ = 0;
};

}  // namespace farhand
