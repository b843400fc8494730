// Sessions side by side: recordings of real processes and runs in virtual time, judged by the same metrics.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/config/load.hpp"
#include "common/judge/alignment.hpp"
#include "common/judge/metrics.hpp"

namespace farhand {

struct ComparisonAsked {
  // Directories of recordings, and scenes to be run in virtual time: SCENE or SCENE,field.path=value,... with settings
  // of its own on top of `sets`.
  std::vector<std::string> sessions;
  std::vector<std::string> sets;      // on top of each scene, not of what was recorded
  std::optional<std::uint64_t> seed;  // instead of that of each scene
  bool lab = false;  // also run what the processes of each directory ran, with its settings, in virtual time
};

struct ComparedSession {
  std::string name;    // of the directory or of the scene; unique among the sessions of processes, and among the lab's
  bool in_lab = true;  // in virtual time; false: real processes
  LoadedScene loaded;
  Metrics metrics;
  AlignedSession curves;
};

// In the order in which they were asked for, a run of the lab behind the directory that it repeats. Throws one clear
// sentence for the first mistake; nothing is run before all of it is known to be right.
std::vector<ComparedSession> compared_sessions(const ComparisonAsked& asked);

// Processes against the lab.
struct SteadyDifference {
  std::size_t processes, lab;  // which of the sessions
  double force_ratio;          // of the processes less that of the lab; NaN where there is none
  std::string absent_because;  // not empty exactly then
};

// One for every pair of processes and lab whose settings are the same, except how processes run on their machine; and
// one that says what differs where a session of processes has only lab runs of the same name and other settings.
std::vector<SteadyDifference> steady_differences(const std::vector<ComparedSession>& sessions);

}  // namespace farhand
