// Which of the two sides: the therapist's station leads, the patient's box follows.
#pragma once

#include <cstdint>

namespace farhand {

enum class Role : std::uint8_t { kLeader = 1, kFollower = 2 };  // as on the wire (proto/packet.proto)

}  // namespace farhand
