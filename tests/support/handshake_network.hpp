// A dialer and a listener with a network between them, in virtual time. Handshakes run from both sides' first word to
// the agreement within milliseconds of real time, whatever the delay and the loss.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "common/secure/handshaker.hpp"
#include "netem/lab/sealed_pair.hpp"
#include "netem/link_model.hpp"

namespace farhand {

inline const UdpEndpoint kDialerAt = endpoint(1000), kListenerAt = endpoint(2000);

// What one seals the other opens.
inline bool share_keys(MediaSession& a, MediaSession& b) {
  const std::array<std::byte, 5> packet{};
  const auto sealed = a.seal(packet);
  std::vector<std::byte> datagram(sealed.begin(), sealed.end());
  std::span<std::byte> opened;
  return b.open(datagram, opened) == MediaSession::Opening::kOpened;
}

class HandshakeNetwork {
 public:
  // What a party has ended up with.
  struct Party {
    std::unique_ptr<Handshaker> handshaker;
    UdpEndpoint at;
    std::vector<std::unique_ptr<MediaSession>> sessions;
    std::vector<HandshakeEvent> events;
    int sent = 0;

    int count(HandshakeEvent::Kind kind) const {
      int n = 0;
      for (const HandshakeEvent& event : events) n += event.kind == kind ? 1 : 0;
      return n;
    }
  };

  HandshakeNetwork(const LinkModelParams& link, std::uint64_t seed)
      : forward_(link, seed, LinkDirection::kForward), backward_(link, seed, LinkDirection::kBackward) {}

  Party& add(std::unique_ptr<Handshaker> handshaker, const UdpEndpoint& at) {
    parties_.push_back(std::make_unique<Party>(Party{std::move(handshaker), at, {}, {}, 0}));
    return *parties_.back();
  }

  // Sees everything that is sent, before the network: what an attacker on the path sees. False takes it away.
  std::function<bool(const UdpEndpoint& from, HandshakeDatagram& datagram)> on_path;

  void inject(const UdpEndpoint& from, const UdpEndpoint& to, std::span<const std::byte> bytes, Nanoseconds delay = 0) {
    on_way_.emplace(now_ + delay, OnWay{to, to_datagram(from, bytes)});
  }

  Nanoseconds now() const { return now_; }

  // In steps of a millisecond until the condition holds, or `at_most` is over.
  template <class Condition>
  bool run_until(Condition&& condition, Nanoseconds at_most) {
    for (const Nanoseconds end = now_ + at_most; now_ < end; now_ += kMillisecond) {
      while (!on_way_.empty() && on_way_.begin()->first <= now_) {
        const OnWay next = on_way_.begin()->second;
        on_way_.erase(on_way_.begin());
        for (auto& party : parties_) {
          if (party->at == next.to) party->handshaker->receive(next.datagram, now_);
        }
      }
      for (auto& party : parties_) {
        party->handshaker->advance(now_);
        collect(*party);
      }
      if (condition()) return true;
    }
    return false;
  }
  void run(Nanoseconds duration) {
    run_until([] { return false; }, duration);
  }

 private:
  struct OnWay {
    UdpEndpoint to;
    HandshakeDatagram datagram;  // its peer is the sender
  };

  void collect(Party& party) {
    HandshakeDatagram datagram;
    while (party.handshaker->take_outgoing(datagram)) {
      ++party.sent;
      const UdpEndpoint to = datagram.peer;
      if (on_path && !on_path(party.at, datagram)) continue;
      const LinkModel::Fate fate = (to == kListenerAt ? forward_ : backward_).offer(now_);
      if (!fate.lost) inject(party.at, to, datagram.view(), fate.delay);
    }
    while (auto session = party.handshaker->take_session()) party.sessions.push_back(std::move(session));
    while (auto event = party.handshaker->take_event()) party.events.push_back(*event);
  }

  LinkModel forward_, backward_;
  std::vector<std::unique_ptr<Party>> parties_;
  std::multimap<Nanoseconds, OnWay> on_way_;
  Nanoseconds now_ = kSecond;
};

}  // namespace farhand
