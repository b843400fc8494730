// Who has to go when every place of a handshake is taken? Strangers fill the places too, so they are shared between
// hosts like this:
//
//   Between hosts: a host with fewer places gets one of the host with the most, at once. So a host keeps another out
//   only with as many addresses as there are places. Within a host, and between hosts with as many: the newest gets the
//   place of the oldest, if that has had it for 2 s: a round trip of 1 s, and what was said again. A hello that is
//   renewed keeps the age of the first. Whoever has shown that it knows the key keeps its place.
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <span>

#include "common/link/udp.hpp"
#include "common/signal/joints.hpp"

namespace farhand {

inline constexpr std::size_t kHandshakePlaces = 128;  // each some 40 kB
inline constexpr Nanoseconds kPlaceFor = 2 * kSecond;

struct PlaceTaken {
  UdpHost host;
  Nanoseconds since = 0;   // first hello
  bool authentic = false;  // has shown that it knows the key
};

// The index of the one that makes room for `newcomer`; nothing if none does.
std::optional<std::size_t> who_makes_room(std::span<const PlaceTaken> taken, const UdpHost& newcomer,
                                          Nanoseconds now) noexcept;

}  // namespace farhand
