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

std::string name_of(Role role) {
  if (role == Role::kLeader) return "the therapist's station";
  if (role == Role::kFollower) return "the patient's box";
  return "of an unknown role";
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
  message.set_heard(greeting.heard);
  std::string bytes = message.SerializeAsString();
  if (bytes.size() > kLargest) throw std::length_error("a greeting does not fit into one datagram");
  return bytes;
}

std::optional<Greeting> decode_greeting(std::span<const std::byte> bytes) {
  wire::Greeting message;
  if (bytes.size() > kLargest || !message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return {};
  Greeting greeting;
  greeting.version = message.version();
  greeting.role = message.role() <= 255 ? static_cast<Role>(message.role()) : Role{};
  greeting.joints = message.joints();
  greeting.units = message.units();
  greeting.configuration = message.configuration();
  greeting.program = message.program();
  greeting.heard = message.heard();
  return greeting;
}

std::optional<std::string> disagreement(const Greeting& own, const Greeting& peer) {
  if (peer.version != own.version) {
    return "version: the peer (farhand " + shown(peer.program) + ") speaks version " + std::to_string(peer.version) +
           " of the protocol, this program (farhand " + own.program + ") version " + std::to_string(own.version) +
           "; update the older one";
  }
  const auto wanted = own.role == Role::kLeader ? Role::kFollower : Role::kLeader;
  if (peer.role != wanted) {
    return "role: the peer is " + name_of(peer.role) + ", but this side needs " + name_of(wanted);
  }
  if (peer.joints != own.joints) {
    return "degrees of freedom: the peer has " + std::to_string(peer.joints) + ", this side " +
           std::to_string(own.joints);
  }
  if (peer.units != own.units) {
    return "units: the peer counts in " + shown(peer.units) + ", this side in " + own.units;
  }
  if (peer.configuration != own.configuration) {
    return "configuration: the peer's is " + shown(peer.configuration.substr(0, 8)) + ", this side's " +
           own.configuration.substr(0, 8) + "; start both with the same scene and the same --set";
  }
  return std::nullopt;
}

}  // namespace farhand
