#include "common/secure/secure_channel.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace farhand {
namespace {

using Opening = MediaSession::Opening;

// RFC 5764, 5.1.2: the first byte tells the two protocols apart that share the port.
bool is_dtls(std::byte first) noexcept { return first >= std::byte{20} && first <= std::byte{63}; }

}  // namespace

std::unique_ptr<MediaSession> SecureChannel::offer(std::unique_ptr<MediaSession> session, Nanoseconds now) noexcept {
  Place& place = end_ == LinkEnd::kDialer ? active_ : waiting_;
  if (end_ == LinkEnd::kDialer) ++counters_.sessions;
  place.heard = now;
  return std::exchange(place.session, std::move(session));
}

SecureChannel::Incoming SecureChannel::open(std::span<std::byte> datagram, const UdpEndpoint& from, Nanoseconds now,
                                            std::span<std::byte>& packet) noexcept {
  if (!datagram.empty() && is_dtls(datagram[0])) {
    ++counters_.handshake;
    return Incoming::kHandshake;
  }
  const bool for_active = active_.session != nullptr && active_.session->peer() == from;
  const bool for_waiting = waiting_.session != nullptr && waiting_.session->peer() == from;
  if (!for_active && !for_waiting) {
    ++(active_.session || waiting_.session ? counters_.foreign : counters_.no_session);
    return Incoming::kRejected;
  }
  Opening opening = Opening::kForged;
  if (for_waiting) {
    // Opening changes the bytes even if it fails: what may still be of the session in force is tried on a copy.
    std::array<std::byte, MediaSession::kLargestDatagram> copy;
    const std::size_t size = std::min(datagram.size(), copy.size());
    if (for_active) std::copy_n(datagram.begin(), size, copy.begin());
    opening = waiting_.session->open(datagram, packet);
    if (opening == Opening::kOpened) {
      take_over();
    } else if (for_active) {
      std::copy_n(copy.begin(), size, datagram.begin());
      opening = active_.session->open(datagram, packet);
    }
  } else {
    opening = active_.session->open(datagram, packet);
  }
  count(opening);
  if (opening != Opening::kOpened) return Incoming::kRejected;
  active_.heard = now;
  return Incoming::kPacket;
}

void SecureChannel::take_over() noexcept {
  displaced_ = std::exchange(active_.session, std::move(waiting_.session));
  ++counters_.sessions;
}

void SecureChannel::count(MediaSession::Opening opening) noexcept {
  switch (opening) {
    case Opening::kOpened:
      ++counters_.opened;
      return;
    case Opening::kMalformed:
      ++counters_.malformed;
      return;
    case Opening::kForged:
      ++counters_.forged;
      return;
    case Opening::kReplayed:
      ++counters_.replayed;
      return;
  }
}

std::span<const std::byte> SecureChannel::seal(std::span<const std::byte> packet) noexcept {
  const auto sealed = active_.session ? active_.session->seal(packet) : std::span<const std::byte>{};
  ++(sealed.empty() ? counters_.unsent : counters_.sealed);
  return sealed;
}

std::unique_ptr<MediaSession> SecureChannel::retire(Nanoseconds now) noexcept {
  if (displaced_) return std::move(displaced_);
  for (Place* place : {&active_, &waiting_}) {
    if (!place->session || now - place->heard < kSilence) continue;
    ++counters_.silent;
    return std::move(place->session);
  }
  return nullptr;
}

}  // namespace farhand
