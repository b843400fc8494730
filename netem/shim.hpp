// Stands between two stations on real sockets and applies the link model to their datagrams. The slave dials the shim,
// the shim dials the master; answers go to the newest client. Every datagram leaves at its arrival (by the kernel's
// stamp) plus the delay drawn for it, in the order of these times.
#pragma once

#include <array>
#include <cstddef>
#include <functional>

#include "common/link/udp.hpp"
#include "common/record/session.hpp"
#include "common/runtime/stop_signals.hpp"
#include "netem/delay_statistics.hpp"
#include "netem/link_model.hpp"
#include "netem/pending.hpp"

namespace farhand {

// One direction, with the counts of its datagrams.
struct ShimWay {
  LinkModel model;
  UdpSocket* in;
  UdpSocket* out;
  bool forward;
  PendingDatagrams waiting{kCapacity};
  Nanoseconds newest_arrival_ns = 0;

  std::uint64_t entered = 0;
  std::uint64_t lost = 0;      // by the model
  std::uint64_t overflow = 0;  // the queue was full
  std::uint64_t unsent = 0;    // nobody to send to, or refused by the system
  DelayStatistics asked{}, achieved{}, lateness{};

  static constexpr std::size_t kCapacity = 16'384;  // 16 s of one datagram per millisecond
};

class Shim {
 public:
  // Called when a datagram has left or is lost, with the time at which it entered.
  using OnPacket = std::function<void(Nanoseconds entered_ns, const LinkSample& sample)>;

  // Throws like UdpSocket::listen and LinkModel.
  Shim(const UdpEndpoint& listen, const UdpEndpoint& master, const LinkModelParams& forward,
       const LinkModelParams& backward, std::uint64_t seed);
  Shim(const Shim&) = delete;
  Shim& operator=(const Shim&) = delete;

  UdpEndpoint local_endpoint() const { return to_slave_.local_endpoint(); }

  // Until a signal comes or the duration (0: none) is over.
  void run(Nanoseconds duration, const StopSignals& stop, const OnPacket& on_packet = {});

  const ShimWay& forward() const noexcept { return forward_; }
  const ShimWay& backward() const noexcept { return backward_; }

 private:
  void take_in(ShimWay& way, const OnPacket& on_packet);
  void let_out(ShimWay& way, const OnPacket& on_packet);
  Nanoseconds arrival(const ShimWay& way) const noexcept;
  void wait(Nanoseconds until) const noexcept;

  UdpSocket to_slave_;
  UdpSocket to_master_;
  ShimWay forward_;   // master to slave
  ShimWay backward_;  // slave to master
  Nanoseconds first_packet_ns_ = -1;
};

}  // namespace farhand
