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

// In the order of the request; a run of the lab follows the directory that it repeats. Throws one clear sentence for
// the first mistake; no session runs before the whole request is known to be valid.
std::vector<ComparedSession> compared_sessions(const ComparisonAsked& asked);

// Difference of the steady ratio between processes and lab.
struct SteadyDifference {
  std::size_t processes, lab;  // which of the sessions
  double force_ratio;          // of the processes less that of the lab; NaN if absent
  std::string absent_because;  // not empty exactly then
};

// One for every pair of processes and lab with the same settings, except those of the processes' machine. If a session
// of processes has only lab runs of the same name with other settings, one that names the difference.
std::vector<SteadyDifference> steady_differences(const std::vector<ComparedSession>& sessions);

}  // namespace farhand
