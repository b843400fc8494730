// Two ends of a secured session without the handshake: keys from a seed.
#pragma once

#include <random>

#include "common/secure/media_session.hpp"

namespace farhand {

inline SrtpKeys keys_from(std::uint64_t seed) {
  std::mt19937_64 bits(seed);
  SrtpKeys keys;
  for (auto& byte : keys.bytes) byte = static_cast<std::uint8_t>(bits());
  return keys;
}

inline UdpEndpoint endpoint(std::uint16_t port) {
  UdpEndpoint e;
  e.address = {127, 0, 0, 1};
  e.port = port;
  return e;
}

struct SealedPair {
  explicit SealedPair(std::uint64_t seed, const UdpEndpoint& dialer_at = endpoint(1000),
                      const UdpEndpoint& listener_at = endpoint(2000))
      : dialer(std::make_unique<MediaSession>(LinkEnd::kDialer, keys_from(seed), listener_at)),
        listener(std::make_unique<MediaSession>(LinkEnd::kListener, keys_from(seed), dialer_at)) {}
  std::unique_ptr<MediaSession> dialer, listener;
};

}  // namespace farhand
