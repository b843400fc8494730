// What the host counts on its serial line, in frames.
#pragma once

#include <cstdint>

namespace farhand {

struct SerialCounters {
  std::uint64_t sent = 0, received = 0, crc_errors = 0, framing_errors = 0, dropped = 0;
};

}  // namespace farhand
