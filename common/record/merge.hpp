// Converts the recordings of master, slave, netem and MCU emulator to one time axis: the master's clock, 0 at its
// start.
#pragma once

#include <filesystem>

#include "common/record/session_file.hpp"

namespace farhand {

// The offset that is added to the slave's clock to get the master's. The true offset lies within +- bound; bound is
// infinite if packets were not received in both directions.
struct ClockOffset {
  double offset_s = 0, bound_s = 0;
  bool one_rate = true;  // false: no constant offset explains the stamps, the clocks drifted apart during the run
};

// Computed from the send and arrival stamps of the newest packets. No transit time is negative. With slave = master +
// theta the smallest arrival - send of all packets is therefore at least theta forward and at least -theta backward:
//   -min_backward <= theta <= min_forward,  offset = -theta in the middle, half the smallest round trip to either side.
// Clocks of unequal rate invert the interval once they drift by more than the round trip. theta then varied within the
// inverted interval, widened by the round trip, which the echoes measure (rtt_s) on one clock alone.
ClockOffset estimate_clock_offset(const Recorded::Series<StationSample>& master,
                                  const Recorded::Series<StationSample>& slave);

// Reads master, slave, netem and mcu .mcap, or .mcap.part of a killed process, from `directory`; of several files of a
// role the one with the highest number. Missing, damaged and ignored recordings become events of the session. Throws
// std::runtime_error if neither station has a readable recording.
Session merge_recordings(const std::filesystem::path& directory);

}  // namespace farhand
