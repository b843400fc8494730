// What a station's packets travel through: the secured link, or a bare socket that reaches this machine only. Called
// from the loop: nothing here waits, allocates or locks.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "common/link/greeting.hpp"
#include "common/link/udp.hpp"
#include "common/secure/pairing_key.hpp"
#include "common/secure/secure_channel.hpp"
#include "common/signal/joints.hpp"

namespace farhand {

// Datagrams that came to nothing before anybody decoded them, and those that did not leave.
struct LinkDrops {
  std::uint64_t too_long = 0;     // longer than any of ours
  std::uint64_t by_kernel = 0;    // too long as well, or the socket was full
  std::uint64_t foreign = 0;      // of an address that no session is bound to
  std::uint64_t handshake = 0;    // of handshakes: beyond the budget of their host, or the queue was full
  std::uint64_t send_failed = 0;  // refused by the system, or nobody listens there
};

inline LinkDrops drops_of(const UdpSocket& socket) noexcept {
  const UdpSocket::Counters& c = socket.counters();
  return {.too_long = c.oversized,
          .by_kernel = socket.dropped_by_kernel(),
          .send_failed = c.would_block + c.refused + c.errors};
}

class PeerLink {
 public:
  virtual ~PeerLink() = default;

  // Once per tick, before anything is received.
  virtual void advance(Nanoseconds now) noexcept = 0;

  enum class Received : std::uint8_t { kNothing, kOther, kPacket };
  // One datagram. kOther: it was none of the station's; there may be more. `packet` lies in `buffer` and is set only
  // with kPacket.
  virtual Received receive(std::span<std::byte> buffer, Nanoseconds now,
                           std::span<const std::byte>& packet) noexcept = 0;
  // What was received last was a good packet: the bare link answers to its sender from now on.
  virtual void accept() noexcept = 0;
  virtual bool send(std::span<const std::byte> packet) noexcept = 0;

  // Before the loop: whether the peer has called. The secured link takes what has come up to its first packet.
  virtual bool called(Nanoseconds now) noexcept = 0;
  // The peer is authentic and does not fit: said on stderr by then.
  virtual bool refused() const noexcept { return false; }
  virtual const ChannelCounters* security() const noexcept { return nullptr; }  // of the secured link
  virtual LinkDrops drops() const noexcept { return drops_of(socket()); }

  virtual const UdpSocket& socket() const noexcept = 0;
};

// The socket must reach loopback only.
std::unique_ptr<PeerLink> make_bare_link(UdpSocket socket);
// Shakes hands in a thread of its own, which ends with the link. `program` begins what it says on stderr. A socket that
// dials makes a dialer.
std::unique_ptr<PeerLink> make_secured_link(UdpSocket socket, const PairingKey& key, const Greeting& own,
                                            const std::string& program);

}  // namespace farhand
