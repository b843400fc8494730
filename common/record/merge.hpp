// Brings the recordings of master, slave, netem and MCU emulator onto one axis of time: the master's clock, 0 at its
// start.
#pragma once

#include <filesystem>

#include "common/record/session_file.hpp"

namespace farhand {

// What is added to the slave's clock to get the master's. The true offset lies within +- bound; bound is infinite when
// packets were not received in both directions.
struct ClockOffset {
  double offset_s = 0, bound_s = 0;
  bool one_rate = true;  // false: no constant offset explains the stamps, the clocks drifted apart during the run
};

// From the send and arrival stamps of the newest packets. A packet takes no negative time, so with slave = master +
// theta the smallest arrival - send of all packets is at least theta forward and at least -theta backward:
//   -min_backward <= theta <= min_forward,  offset = -theta in the middle, half the smallest round trip to either side.
// Clocks of unequal rate turn the interval inside out once they drift by more than the round trip; theta then ranged
// over the inverted interval widened by the round trip, which the echoes measure (rtt_s) on one clock alone.
ClockOffset estimate_clock_offset(const Recorded::Series<StationSample>& master,
                                  const Recorded::Series<StationSample>& slave);

// Reads master, slave, netem and mcu .mcap, or .mcap.part of a killed process, from `directory`; of several of a role
// that with the highest number. What is missing, damaged or not read becomes an event of the session. Throws
// std::runtime_error when neither station has a readable recording.
Session merge_recordings(const std::filesystem::path& directory);

}  // namespace farhand
