// The message that two stations exchange before the first packet, and the check whether they fit together. A difference
// is refused with a sentence that names it: two sides with different units or gains would exchange packets that are
// authentic, intact and wrong.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "common/link/packet.hpp"
#include "common/signal/role.hpp"

namespace farhand {

struct Greeting {
  std::uint32_t version = kProtocolVersion;
  Role role = Role::kLeader;
  std::uint32_t joints = 1;
  std::string units = "rad, rad/s, N m, ns";
  std::string configuration;  // fingerprint of the settings that must be equal on both sides
  std::string program;        // version, shown only
  bool heard = false;         // the greeting of the other side has come
};

// At most 400 bytes, so that it fits into one datagram with its record; else throws std::length_error.
std::string encode_greeting(const Greeting& greeting);

std::optional<Greeting> decode_greeting(std::span<const std::byte> bytes);

// Returns a sentence on the first difference, or an empty value if they fit together.
std::optional<std::string> disagreement(const Greeting& own, const Greeting& peer);

}  // namespace farhand
