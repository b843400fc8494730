// One handshake with one peer, from the first datagram to the agreement: DTLS, then the greetings of both sides inside
// it. What the peer has not answered is said again, byte for byte, after 0.2 s, 0.4 s, ... 1 s: OpenSSL would do that
// by the wall clock, here time is an argument. A repeated record that arrives twice is dropped by the replay window of
// DTLS.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/link/greeting.hpp"
#include "common/secure/dtls.hpp"
#include "common/signal/joints.hpp"

namespace farhand {

class Association {
 public:
  static constexpr Nanoseconds kAttempt = 10 * kSecond;  // an agreement that takes longer has failed

  // For the dialer: sends the first message. For the listener: `dtls` has just verified a cookie.
  Association(LinkEnd end, std::unique_ptr<Dtls> dtls, const Greeting& own, const UdpEndpoint& peer, Nanoseconds now);

  void receive(std::span<const std::byte> datagram, Nanoseconds now);
  void advance(Nanoseconds now);

  // True if there is nothing left to send. Until then it goes on answering and repeating, also after agreement.
  bool settled(Nanoseconds now) const noexcept;

  enum class State : std::uint8_t { kRunning, kAgreed, kRefused, kFailed };
  State state() const noexcept { return state_; }
  const std::string& why() const noexcept { return why_; }  // refused or failed
  const UdpEndpoint& peer() const noexcept { return peer_; }
  // The peer has shown that it knows the key.
  bool authentic() const noexcept { return dtls_->state() == Dtls::State::kConnected; }

  std::unique_ptr<MediaSession> make_session() const;  // once agreed
  std::vector<Bytes> take_outgoing() { return std::exchange(outgoing_, {}); }

 private:
  void handshake(std::span<const std::byte> datagram, Nanoseconds now);
  void exchange_greetings();
  void greet();
  void emit_written();
  void end(State state, std::string why);

  LinkEnd end_;
  std::unique_ptr<Dtls> dtls_;
  Greeting own_;
  UdpEndpoint peer_;
  Nanoseconds begun_;
  Nanoseconds repeat_at_ = 0, repeat_after_ = 0;
  State state_ = State::kRunning;
  bool heard_ = false;      // the peer's greeting
  bool was_heard_ = false;  // ours, as the peer says
  std::string why_;
  std::vector<Bytes> flight_;  // the last one sent, until it is known to have arrived
  std::vector<Bytes> outgoing_;
};

}  // namespace farhand
