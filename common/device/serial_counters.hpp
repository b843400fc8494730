// What the host counts on its serial line, in frames, and how long that line takes.
#pragma once

#include <cstdint>

namespace farhand {

struct SerialCounters {
  std::uint64_t sent = 0, received = 0, crc_errors = 0, framing_errors = 0, dropped = 0;
  // Of a command and its echo together, s. 0: not measured.
  double age_s = 0, need_s = 0, most_age_s = 0;  // the last; the least, which the line needs; the most of all
  std::uint64_t warned = 0;                      // echoes that came 10 ms later than the line needs
  bool warns = false;                            // the last one did
  bool blind = false;                            // this host looks too late to know
  std::uint64_t sagged = 0;  // times that the MCU, without a command for 20 ms, let go of its torque
};

}  // namespace farhand
