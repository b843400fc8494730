// The settings of a receiver.
#pragma once

#include "common/signal/joints.hpp"

namespace farhand {

struct ReceiverParams {
  Nanoseconds timeout = 100 * kMillisecond;  // silence after which the peer counts as gone
  Nanoseconds brief = 0;                     // a silence no longer than this leaves the play-out as it is
  Nanoseconds playout_max = 2 * kSecond;     // largest depth of the play-out
  Nanoseconds expiry = 2 * kSecond;          // a packet slower than the fastest by more than this is never acted upon
};

}  // namespace farhand
