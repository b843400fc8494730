// Makes secured sessions, off the loop's thread: the dialer calls its peer until it answers, the listener answers
// whoever calls. Pure: datagrams and time go in, datagrams, sessions and events come out, so that whole handshakes run
// over a simulated network in virtual time.
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

// From or to whom, by value: it crosses between threads through rings that never allocate.
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
    kRefused,  // authentic, but the two do not fit together: nothing but a person can change that
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
  // One that take_session() gave is no longer used. The dialer calls again once none is.
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
