#include "common/link/greeting.hpp"

#include <algorithm>
#include <stdexcept>

#include "proto/packet.pb.h"

namespace farhand {
namespace {

constexpr std::size_t kLargest = 400;

// What the peer says is shown to a person: no control characters, no endless text.
std::string shown(const std::string& text) {
  std::string out = text.substr(0, 40);
  std::replace_if(
      out.begin(), out.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return out.empty() ? "nothing" : out;
}

std::string role_name(std::uint32_t role) {
  if (role == static_cast<std::uint32_t>(StationRole::kTherapist)) return "the therapist's station";
  if (role == static_cast<std::uint32_t>(StationRole::kPatient)) return "the patient's box";
  return "of the unknown role " + std::to_string(role);
}

}  // namespace

std::string encode_greeting(const Greeting& greeting) {
  wire::Greeting message;
  message.set_version(greeting.version);
  message.set_role(static_cast<std::uint32_t>(greeting.role));
  message.set_joints(greeting.joints);
  message.set_units(greeting.units);
  message.set_configuration(greeting.configuration);
  message.set_program(greeting.program);
  std::string bytes = message.SerializeAsString();
  if (bytes.size() > kLargest) throw std::length_error("a greeting does not fit into one datagram");
  return bytes;
}

std::optional<std::string> disagreement(const Greeting& own, std::span<const std::byte> peer) {
  wire::Greeting theirs;
  if (peer.size() > kLargest || !theirs.ParseFromArray(peer.data(), static_cast<int>(peer.size()))) {
    return "the peer's greeting cannot be read";
  }
  const std::string peer_program = "farhand " + shown(theirs.program());
  if (theirs.version() != own.version) {
    return "version: the peer (" + peer_program + ") speaks version " + std::to_string(theirs.version()) +
           " of the protocol, this program (farhand " + own.program + ") version " + std::to_string(own.version) +
           "; update the older one";
  }
  const auto wanted = own.role == StationRole::kTherapist ? StationRole::kPatient : StationRole::kTherapist;
  if (theirs.role() != static_cast<std::uint32_t>(wanted)) {
    return "role: the peer is " + role_name(theirs.role()) + ", but this side needs " +
           role_name(static_cast<std::uint32_t>(wanted));
  }
  if (theirs.joints() != own.joints) {
    return "degrees of freedom: the peer has " + std::to_string(theirs.joints()) + ", this side " +
           std::to_string(own.joints);
  }
  if (theirs.units() != own.units) {
    return "units: the peer counts in " + shown(theirs.units()) + ", this side in " + own.units;
  }
  if (theirs.configuration() != own.configuration) {
    return "configuration: the peer's is " + shown(theirs.configuration().substr(0, 8)) + ", this side's " +
           own.configuration.substr(0, 8) + "; start both with the same scene and the same --set";
  }
  return std::nullopt;
}

}  // namespace farhand
