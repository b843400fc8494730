#include "common/secure/handshaker.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "common/secure/association.hpp"
#include "common/secure/dtls.hpp"
#include "common/secure/places.hpp"

namespace farhand {
namespace {

using State = Association::State;

HandshakeEvent event_of(const Association& association) {
  const auto kind = association.state() == State::kAgreed    ? HandshakeEvent::Kind::kAgreed
                    : association.state() == State::kRefused ? HandshakeEvent::Kind::kRefused
                                                             : HandshakeEvent::Kind::kFailed;
  return {kind, association.peer(), association.why()};
}

class Dialer final : public Handshaker {
 public:
  Dialer(const PairingKey& key, const Greeting& own, const UdpEndpoint& peer)
      : context_(LinkEnd::kDialer, key), own_(own), peer_(peer) {}

  void receive(const HandshakeDatagram& datagram, Nanoseconds now) override {
    if (!calling_ || datagram.peer != peer_) return;
    calling_->receive(datagram.view(), now);
    look(now);
  }

  void advance(Nanoseconds now) override {
    if (!calling_ && in_use_ == 0 && now >= not_before_) {
      calling_ = std::make_unique<Association>(LinkEnd::kDialer, std::make_unique<Dtls>(context_), own_, peer_, now);
      told_ = false;
    }
    if (!calling_) return;
    calling_->advance(now);
    look(now);
  }

  void give_back(std::unique_ptr<MediaSession>, Nanoseconds) override {
    --in_use_;
    if (in_use_ == 0 && told_) calling_.reset();
  }

 private:
  // A forged alert can end an attempt, so every end but agreement is followed by another, with a pause.
  void look(Nanoseconds now) {
    for (const Bytes& bytes : calling_->take_outgoing()) outgoing_.push_back(to_datagram(peer_, bytes));
    if (calling_->state() == State::kRunning) return;
    if (!told_) {
      told_ = true;
      events_.push_back(event_of(*calling_));
      if (calling_->state() == State::kAgreed) {
        sessions_.push_back(calling_->make_session());
        ++in_use_;
      }
    }
    if (!calling_->settled(now)) return;
    if (calling_->state() != State::kAgreed) {
      not_before_ = now + (calling_->state() == State::kRefused ? 5 * kSecond : kSecond / 2);
    }
    calling_.reset();
  }

  DtlsContext context_;
  Greeting own_;
  UdpEndpoint peer_;
  std::unique_ptr<Association> calling_;
  bool told_ = false;  // how it ended
  int in_use_ = 0;
  Nanoseconds not_before_ = std::numeric_limits<Nanoseconds>::min();
};

// The first record of a DTLS handshake, in the clear; where its 32 random bytes stand (RFC 6347, 4.2.2 and RFC 5246,
// 7.4.1.2).
constexpr std::size_t kRandomAt = 27, kRandomBytes = 32;
bool is_client_hello(std::span<const std::byte> d) noexcept {
  return d.size() >= kRandomAt + kRandomBytes && d[0] == std::byte{22} && d[3] == std::byte{0} &&
         d[4] == std::byte{0} && d[13] == std::byte{1};
}

class Listener final : public Handshaker {
 public:
  Listener(const PairingKey& key, const Greeting& own) : context_(LinkEnd::kListener, key), own_(own) {}

  void receive(const HandshakeDatagram& datagram, Nanoseconds now) override {
    const std::span<const std::byte> bytes = datagram.view();
    Caller* caller = find(datagram.peer);
    if (is_client_hello(bytes)) {
      const Random random = random_of(bytes);
      if (caller == nullptr || caller->random != random) return answer(datagram, random, caller, now);
    }
    if (caller == nullptr) return;
    caller->association->receive(bytes, now);
    look(*caller);
  }

  void advance(Nanoseconds now) override {
    for (Caller& caller : callers_) {
      caller.association->advance(now);
      look(caller);
    }
    std::erase_if(callers_, [&](const Caller& caller) { return caller.association->settled(now); });
  }

  void give_back(std::unique_ptr<MediaSession>, Nanoseconds) override {}

 private:
  using Random = std::array<std::byte, kRandomBytes>;
  // A caller must receive our cookie to take a place (places.hpp). One that begins anew stays in its place with its
  // age, and does so twice a second at most, because each beginning costs the arithmetic of a key exchange.
  struct Caller {
    Random random;
    std::unique_ptr<Association> association;
    Nanoseconds since = 0, begun = 0;  // first and newest hello
    bool told = false;
  };
  static constexpr Nanoseconds kRenewed = kSecond / 2;

  static Random random_of(std::span<const std::byte> hello) {
    Random random;
    std::copy_n(hello.begin() + kRandomAt, kRandomBytes, random.begin());
    return random;
  }

  Caller* find(const UdpEndpoint& peer) {
    const auto at = std::find_if(callers_.begin(), callers_.end(),
                                 [&](const Caller& caller) { return caller.association->peer() == peer; });
    return at != callers_.end() ? &*at : nullptr;
  }

  void answer(const HandshakeDatagram& datagram, const Random& random, Caller* known, Nanoseconds now) {
    if (known != nullptr && now - known->begun < kRenewed) return;
    if (!fresh_) fresh_ = std::make_unique<Dtls>(context_);
    const bool verified = fresh_->listen(datagram.view(), datagram.peer);
    for (const Bytes& bytes : fresh_->take_written()) outgoing_.push_back(to_datagram(datagram.peer, bytes));
    if (!verified) return;
    Caller* const place = known != nullptr ? known : make_room(datagram.peer, now);
    if (place == nullptr) {
      fresh_.reset();
      return;
    }
    const Nanoseconds since = place == known ? known->since : now;
    *place = {random, std::make_unique<Association>(LinkEnd::kListener, std::move(fresh_), own_, datagram.peer, now),
              since, now};
    look(*place);
  }

  Caller* make_room(const UdpEndpoint& newcomer, Nanoseconds now) {
    if (callers_.size() < kHandshakePlaces) return &callers_.emplace_back();
    std::array<PlaceTaken, kHandshakePlaces> taken;
    std::transform(callers_.begin(), callers_.end(), taken.begin(), [](const Caller& caller) {
      return PlaceTaken{host_of(caller.association->peer()), caller.since, caller.association->authentic()};
    });
    const std::optional<std::size_t> room = who_makes_room(taken, host_of(newcomer), now);
    return room ? &callers_[*room] : nullptr;
  }

  void look(Caller& caller) {
    Association& association = *caller.association;
    for (const Bytes& bytes : association.take_outgoing()) outgoing_.push_back(to_datagram(association.peer(), bytes));
    if (caller.told || association.state() == State::kRunning) return;
    caller.told = true;
    events_.push_back(event_of(association));
    if (association.state() == State::kAgreed) sessions_.push_back(association.make_session());
  }

  DtlsContext context_;
  Greeting own_;
  std::unique_ptr<Dtls> fresh_;  // the next caller's
  std::vector<Caller> callers_;
};

template <class T>
std::optional<T> pop(std::deque<T>& from) {
  if (from.empty()) return std::nullopt;
  std::optional<T> first = std::move(from.front());
  from.pop_front();
  return first;
}

}  // namespace

HandshakeDatagram to_datagram(const UdpEndpoint& peer, std::span<const std::byte> bytes) noexcept {
  HandshakeDatagram datagram;
  datagram.peer = peer;
  datagram.size = static_cast<std::uint16_t>(std::min(bytes.size(), HandshakeDatagram::kLargest));
  std::copy_n(bytes.begin(), datagram.size, datagram.bytes.begin());
  return datagram;
}

std::unique_ptr<Handshaker> Handshaker::dialer(const PairingKey& key, const Greeting& own, const UdpEndpoint& peer) {
  return std::make_unique<Dialer>(key, own, peer);
}

std::unique_ptr<Handshaker> Handshaker::listener(const PairingKey& key, const Greeting& own) {
  return std::make_unique<Listener>(key, own);
}

bool Handshaker::take_outgoing(HandshakeDatagram& out) {
  const std::optional<HandshakeDatagram> first = pop(outgoing_);
  if (first) out = *first;
  return first.has_value();
}

std::unique_ptr<MediaSession> Handshaker::take_session() { return pop(sessions_).value_or(nullptr); }

std::optional<HandshakeEvent> Handshaker::take_event() { return pop(events_); }

}  // namespace farhand
