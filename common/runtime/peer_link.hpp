// The link of a station's packets: the secured link, or a bare socket that reaches only this machine. Called from the
// loop: no function waits, allocates or locks.
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

// Datagrams that were dropped before they were decoded, and those that were not sent.
struct LinkDrops {
  std::uint64_t too_long = 0;     // longer than any of ours
  std::uint64_t by_kernel = 0;    // too long, or the socket was full
  std::uint64_t foreign = 0;      // from an address to which no session is bound
  std::uint64_t handshake = 0;    // of handshakes: beyond the budget of their host, or with a full queue
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

  // Once per tick, before receive().
  virtual void advance(Nanoseconds now) noexcept = 0;

  enum class Received : std::uint8_t { kNothing, kOther, kPacket };
  // Receives one datagram. kOther: it was not a packet for the station; there may be more. `packet` lies in `buffer`
  // and is set only with kPacket.
  virtual Received receive(std::span<std::byte> buffer, Nanoseconds now,
                           std::span<const std::byte>& packet) noexcept = 0;
  // The last datagram was a valid packet: from now on the bare link answers to its sender.
  virtual void accept() noexcept = 0;
  virtual bool send(std::span<const std::byte> packet) noexcept = 0;

  // Before the loop: true if the peer has called. The secured link reads all datagrams up to the first packet.
  virtual bool called(Nanoseconds now) noexcept = 0;
  // The peer is authentic but does not fit; the reason has been printed on stderr.
  virtual bool refused() const noexcept { return false; }
  virtual const ChannelCounters* security() const noexcept { return nullptr; }  // of the secured link
  virtual LinkDrops drops() const noexcept { return drops_of(socket()); }

  virtual const UdpSocket& socket() const noexcept = 0;
};

// The socket must reach loopback only.
std::unique_ptr<PeerLink> make_bare_link(UdpSocket socket);
// Handshakes run in a thread of their own, which ends with the link. Sentences on stderr begin with `program`. A socket
// that dials makes a dialer.
std::unique_ptr<PeerLink> make_secured_link(UdpSocket socket, const PairingKey& key, const Greeting& own,
                                            const std::string& program);

}  // namespace farhand
