// Makes secured sessions, outside the loop's thread: the dialer calls its peer until it answers, the listener answers
// every caller. It has no other effects: datagrams and time are inputs; datagrams, sessions and events are outputs.
// Therefore whole handshakes can run over a simulated network in virtual time.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "common/link/greeting.hpp"
#include "common/link/udp.hpp"
#include "common/secure/media_session.hpp"
#include "common/secure/pairing_key.hpp"
#include "common/signal/joints.hpp"

namespace farhand {

// A datagram with its peer, by value: it passes between threads through rings that never allocate.
struct HandshakeDatagram {
  static constexpr std::size_t kLargest = 512;
  UdpEndpoint peer;
  std::uint16_t size = 0;
  std::array<std::byte, kLargest> bytes;

  std::span<const std::byte> view() const noexcept { return std::span(bytes).first(size); }
};
// `bytes` no longer than kLargest.
HandshakeDatagram to_datagram(const UdpEndpoint& peer, std::span<const std::byte> bytes) noexcept;

struct HandshakeEvent {
  enum class Kind : std::uint8_t {
    kAgreed,
    kRefused,  // authentic, but the two do not fit together, which only a person can change
    kFailed,   // no agreement; the dialer tries again
  };
  Kind kind;
  UdpEndpoint peer;
  std::string why;
};

class Handshaker {
 public:
  static std::unique_ptr<Handshaker> dialer(const PairingKey& key, const Greeting& own, const UdpEndpoint& peer);
  static std::unique_ptr<Handshaker> listener(const PairingKey& key, const Greeting& own);
  virtual ~Handshaker() = default;

  virtual void receive(const HandshakeDatagram& datagram, Nanoseconds now) = 0;
  virtual void advance(Nanoseconds now) = 0;
  // Returns a session of take_session() that is no longer used. The dialer calls again once no session is in use.
  virtual void give_back(std::unique_ptr<MediaSession> session, Nanoseconds now) = 0;

  bool take_outgoing(HandshakeDatagram& out);
  std::unique_ptr<MediaSession> take_session();
  std::optional<HandshakeEvent> take_event();

 protected:
  std::deque<HandshakeDatagram> outgoing_;
  std::deque<std::unique_ptr<MediaSession>> sessions_;
  std::deque<HandshakeEvent> events_;
};

}  // namespace farhand
