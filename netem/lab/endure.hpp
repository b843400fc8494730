// Runs a scene for hours or days of virtual time, in memory that does not grow: its session is repeated, and a line is
// kept for each hour. A quantity that grows over the hours (an error, energy, memory) would in the end harm somebody.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "common/config/load.hpp"
#include "netem/lab/workload.hpp"

namespace farhand {

// One stretch of the run.
struct Stretch {
  double until_s = 0;
  double engaged_s = 0;                                    // time during which both sides were engaged
  double tracking_rms_rad = 0, tracking_peak_rad = 0;      // slave against master as played out, while engaged
  double force_error_rms_nm = 0, force_error_peak_nm = 0;  // true torques at the same instant, while engaged
  double energy_residual_master_j = 0, energy_residual_slave_j = 0;  // of this stretch: imbalance of the world's energy
  double energy_rounding_master_j = 0, energy_rounding_slave_j = 0;  // part that rounding can cause (energy_audit.hpp)
  double energy_exchanged_j = 0;                     // supplied and dissipated in this stretch, both worlds
  double playout_mean_s = 0;                         // depth of the slave's play-out
  std::uint64_t lost = 0, late = 0, not_finite = 0;  // packets, both directions
  double wall_s = 0;                                 // wall clock
  std::uint64_t resident_bytes = 0;                  // memory of the process at the end
};

// Repeats the therapist's movements until duration_s; windows and the operator's acts stay as they are.
LoadedScene repeated(LoadedScene loaded, double duration_s);

// Calls `tell` after each stretch, as soon as it is over. After the first tick nothing else uses the heap. Progress is
// counted in seconds of virtual time; throws Stopped if a signal ended the run.
void endure(const LoadedScene& loaded, double stretch_s, const std::function<void(const Stretch&)>& tell,
            const Workload& work = 1);

}  // namespace farhand
