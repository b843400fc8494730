// What two stations tell each other before the first packet, and whether they fit together. A difference is refused by
// a sentence that names it: two sides with other units or gains would exchange packets that are authentic, intact and
// wrong.
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
  std::string configuration;  // fingerprint of what both sides must have alike
  std::string program;        // version, shown only
  bool heard = false;         // the greeting of the other side has come
};

// Must fit into one datagram with its record: at most 400 bytes. Throws std::length_error.
std::string encode_greeting(const Greeting& greeting);

std::optional<Greeting> decode_greeting(std::span<const std::byte> bytes);

// Nothing when they fit together.
std::optional<std::string> disagreement(const Greeting& own, const Greeting& peer);

}  // namespace farhand
