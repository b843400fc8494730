// Decides which caller loses its place when all places for handshakes are taken. Strangers can fill places too;
// therefore places are shared between hosts:
//
//   Between hosts: a host with fewer places gets one at once from the host with the most. A host can therefore keep
//   another out only with as many addresses as there are places. Within a host, and between hosts with equally many:
//   the newest caller gets the place of the oldest, if that has had it for 2 s (a round trip of 1 s and a repetition).
//   A renewed hello keeps the age of the first. A caller that has proved that it knows the key keeps its place.
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

// Index of the caller that makes room for `newcomer`; empty if none does.
std::optional<std::size_t> who_makes_room(std::span<const PlaceTaken> taken, const UdpHost& newcomer,
                                          Nanoseconds now) noexcept;

}  // namespace farhand
