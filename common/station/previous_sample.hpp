// Tells the motion of the packet before once more in each packet, for laws that need it (LawNeeds::previous).
#pragma once

#include <cstdint>
#include <limits>

#include "common/link/packet.hpp"

namespace farhand {

template <int N>
class PreviousSample {
 public:
  // packet.motion is set. A packet that is the first, or whose age does not fit into its field, has no previous sample.
  void tell(Packet<N>& packet, Nanoseconds now) noexcept {
    const Nanoseconds age = now - at_;
    if (any_ && age > 0 && age <= std::numeric_limits<std::uint32_t>::max()) {
      packet.previous_age_ns = static_cast<std::uint32_t>(age);
      packet.previous = motion_;
    }
    any_ = true;
    at_ = now;
    motion_ = packet.motion;
  }

 private:
  bool any_ = false;
  Nanoseconds at_ = 0;
  Motion<N> motion_;
};

}  // namespace farhand
