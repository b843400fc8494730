#include "common/secure/association.hpp"

#include <algorithm>
#include <utility>

namespace farhand {
namespace {

constexpr Nanoseconds kFirstRepeat = kSecond / 5, kLastRepeat = kSecond / 2;
constexpr auto kApplicationData = std::byte{23};  // content type of a DTLS record

}  // namespace

Association::Association(LinkEnd end, std::unique_ptr<Dtls> dtls, const Greeting& own, const UdpEndpoint& peer,
                         Nanoseconds now)
    : end_(end), dtls_(std::move(dtls)), own_(own), peer_(peer), begun_(now) {
  handshake({}, now);
}

void Association::receive(std::span<const std::byte> datagram, Nanoseconds now) {
  if (state_ == State::kFailed || datagram.empty()) return;
  if (dtls_->state() == Dtls::State::kHandshake) {
    handshake(datagram, now);
  } else {
    dtls_->step(datagram);
    // A handshake record after its end: the peer did not hear our last word.
    if (end_ == LinkEnd::kListener && datagram[0] != kApplicationData) {
      outgoing_.insert(outgoing_.end(), flight_.begin(), flight_.end());
    }
  }
  exchange_greetings();
}

void Association::handshake(std::span<const std::byte> datagram, Nanoseconds now) {
  const Dtls::State state = dtls_->step(datagram);
  if (std::vector<Bytes> written = dtls_->take_written(); !written.empty()) {
    outgoing_.insert(outgoing_.end(), written.begin(), written.end());
    flight_ = std::move(written);
    repeat_after_ = kFirstRepeat;
    repeat_at_ = now + repeat_after_;
  }
  if (state == Dtls::State::kFailed) end(State::kFailed, "the handshake failed: " + dtls_->why());
  if (state != Dtls::State::kConnected) return;
  repeat_after_ = kFirstRepeat;
  repeat_at_ = now + repeat_after_;
  greet();
}

void Association::greet() {
  own_.heard = heard_;
  const std::string text = encode_greeting(own_);
  dtls_->send(std::as_bytes(std::span(text)));
  emit_written();
}

void Association::exchange_greetings() {
  while (const std::optional<Bytes> message = dtls_->receive()) {
    const std::optional<Greeting> greeting = decode_greeting(*message);
    if (!greeting) continue;  // authentic noise: a peer that says nothing else is given up in time
    heard_ = true;
    was_heard_ = was_heard_ || greeting->heard;
    if (end_ == LinkEnd::kListener) greet();
    if (state_ != State::kRunning) continue;
    const std::optional<std::string> difference = disagreement(own_, *greeting);
    end(difference ? State::kRefused : State::kAgreed, difference.value_or(""));
  }
  emit_written();
  if (dtls_->state() == Dtls::State::kFailed && state_ == State::kRunning) {
    end(State::kFailed, "the handshake failed: " + dtls_->why());
  }
}

void Association::emit_written() {
  for (Bytes& datagram : dtls_->take_written()) outgoing_.push_back(std::move(datagram));
}

bool Association::settled(Nanoseconds now) const noexcept {
  if (state_ == State::kRunning) return false;
  return state_ == State::kFailed || now - begun_ >= 2 * kAttempt || (end_ == LinkEnd::kDialer && was_heard_);
}

void Association::advance(Nanoseconds now) {
  if (state_ == State::kRunning && now - begun_ >= kAttempt) {
    const bool connected = dtls_->state() == Dtls::State::kConnected;
    return end(State::kFailed, connected ? "the peer did not say what it is" : "the handshake did not end in time");
  }
  if (settled(now) || now < repeat_at_) return;
  repeat_after_ = std::min(2 * repeat_after_, kLastRepeat);
  repeat_at_ = now + repeat_after_;
  if (dtls_->state() == Dtls::State::kHandshake) {
    outgoing_.insert(outgoing_.end(), flight_.begin(), flight_.end());
  } else if (end_ == LinkEnd::kDialer) {
    greet();
  }
}

void Association::end(State state, std::string why) {
  state_ = state;
  why_ = std::move(why);
}

std::unique_ptr<MediaSession> Association::make_session() const {
  return std::make_unique<MediaSession>(end_, dtls_->srtp_keys(), peer_);
}

}  // namespace farhand
