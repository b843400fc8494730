// Counters of the host's serial line, in frames, and the times that the line takes.
#pragma once

#include <cstdint>

namespace farhand {

struct SerialCounters {
  std::uint64_t sent = 0, received = 0, crc_errors = 0, framing_errors = 0, dropped = 0;
  // Times of a command and its echo together, s. 0: not measured.
  double age_s = 0, need_s = 0, most_age_s = 0;  // the last one; the smallest, which the line needs; the largest
  std::uint64_t warned = 0;                      // echoes that came 10 ms later than the line needs
  bool warns = false;                            // the last one did
  bool blind = false;                            // this host reads too late to measure it
  std::uint64_t sagged = 0;                      // number of times that the MCU let go, after 20 ms without a command
};

}  // namespace farhand
