// Ticks that were missed: by this side, according to its loop and its clock, and by the peer, according to its packets.
#pragma once

#include <algorithm>
#include <cstdint>

#include "common/link/packet.hpp"
#include "common/station/drive.hpp"

namespace farhand {

class OwnTicks {
 public:
  explicit OwnTicks(double dt_s) noexcept : dt_s_(dt_s) {}

  // Periods since the last call: `told`, or more if more time has passed on the clock. If the clock went back, the time
  // since is unknown, and the longest gap is returned.
  int since_last(Nanoseconds now, int told) noexcept {
    const double periods = begun_ ? to_seconds(now - last_) / dt_s_ : 0.0;
    last_ = now;
    begun_ = true;
    if (periods < 0.0) return kLongestGap + 1;
    return std::max(told, static_cast<int>(std::min(periods + 0.5, kLongestGap + 1.0)));
  }

 private:
  double dt_s_;
  Nanoseconds last_ = 0;
  bool begun_ = false;
};

class PeerTicks {
 public:
  explicit PeerTicks(double dt_s) noexcept : dt_s_(dt_s) {}

  // Time by which the peer missed its ticks between the newest packet and that of the last call, s: the excess of time
  // over the count of packets. (Packets that the network lost are in the sequence numbers.)
  template <int N>
  double missed_s(const Packet<N>& newest) noexcept {
    const bool follows = newest.session == session_ && newest.seq - seq_ < kMostPackets;
    const double packets = newest.seq - seq_;
    const double time_s = 1e-9 * (static_cast<double>(newest.send_time_ns) - static_cast<double>(send_time_ns_));
    session_ = newest.session;
    seq_ = newest.seq;
    send_time_ns_ = newest.send_time_ns;
    set_back_ = follows && packets * dt_s_ - time_s > kSetBack;
    return follows ? std::clamp(time_s - packets * dt_s_, 0.0, 1.0) : 0.0;
  }

  // Its clock was set back since the last call of missed_s().
  bool set_back() const noexcept { return set_back_; }

 private:
  static constexpr std::uint32_t kMostPackets = 10'000;  // largest step of numbers within a session
  static constexpr double kSetBack = 0.1;                // s
  double dt_s_;
  std::uint32_t session_ = 0, seq_ = 0;
  Nanoseconds send_time_ns_ = 0;
  bool set_back_ = false;
};

}  // namespace farhand
