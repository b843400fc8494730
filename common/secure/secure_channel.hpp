// The loop's part of the secured link: distinguishes handshakes from packets, opens and seals with the session in
// force, and decides which session that is. No function allocates, locks or waits; sessions come from the handshake
// thread and are destroyed there.
//
//   Listener: a new session waits beside the one in force until its first authentic packet comes. Therefore a restarted
//   box, or one behind a new address, takes over, but a caller that only completes a handshake does not. Dialer: a new
//   session is in force at once, because the listener waits for its first packet.
//
// A session is bound to the address of its handshake. It is over after 5 s without an authentic packet.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "common/secure/media_session.hpp"
#include "common/signal/joints.hpp"

namespace farhand {

struct ChannelCounters {
  std::uint64_t sealed = 0;
  std::uint64_t unsent = 0;  // no session in force
  std::uint64_t opened = 0;
  std::uint64_t handshake = 0;  // datagrams of handshakes, forged ones included
  std::uint64_t no_session = 0, foreign = 0, malformed = 0, forged = 0, replayed = 0;  // rejected, by reason
  std::uint64_t sessions = 0;                                                          // taken into force
  std::uint64_t silent = 0;                                                            // ended by silence
};

class SecureChannel {
 public:
  static constexpr Nanoseconds kSilence = 5 * kSecond;

  explicit SecureChannel(LinkEnd end) noexcept : end_(end) {}

  // Takes the session of a successful handshake. Returns the session that this one displaces, if any.
  std::unique_ptr<MediaSession> offer(std::unique_ptr<MediaSession> session, Nanoseconds now) noexcept;

  enum class Incoming : std::uint8_t { kPacket, kHandshake, kRejected };
  // In place. `packet` is set only with kPacket.
  Incoming open(std::span<std::byte> datagram, const UdpEndpoint& from, Nanoseconds now,
                std::span<std::byte>& packet) noexcept;

  // For peer(). Valid until the next call; empty while no session is in force.
  std::span<const std::byte> seal(std::span<const std::byte> packet) noexcept;
  bool in_force() const noexcept { return active_.session != nullptr; }
  const UdpEndpoint& peer() const noexcept { return active_.session->peer(); }  // only while in force

  // Returns one ended session, if any. Call it once per tick, before offer(), until none is left.
  std::unique_ptr<MediaSession> retire(Nanoseconds now) noexcept;

  const ChannelCounters& counters() const noexcept { return counters_; }

 private:
  struct Place {
    std::unique_ptr<MediaSession> session;
    Nanoseconds heard = 0;
  };
  void take_over() noexcept;
  void count(MediaSession::Opening opening) noexcept;

  LinkEnd end_;
  Place active_, waiting_;
  std::unique_ptr<MediaSession> displaced_;
  ChannelCounters counters_;
};

}  // namespace farhand
