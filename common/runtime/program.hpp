// What every farhand program shares: how a scene is chosen, how mistakes are said, how a run ends.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/config/load.hpp"
#include "common/record/recorder.hpp"
#include "common/runtime/command.hpp"
#include "common/runtime/run_loop.hpp"

namespace farhand {

struct SceneChoice {
  std::string scene;
  std::vector<std::string> sets;
  std::optional<std::uint64_t> seed;
  bool real_time = false;

  // Says the scene's warnings on stderr. In real time what only virtual time can follow is refused:
  // std::invalid_argument.
  LoadedScene load() const;
};

void add_scene_option(Command command, SceneChoice& choice);    // --scene, --set, --seed; in real time
void add_scene_argument(Command command, SceneChoice& choice);  // SCENE, --set, --seed

// What stands at the head of a recording that begins now.
record::RunInfo run_info(const LoadedScene& scene, const std::string& role);
// None without a file name. Says on stderr where the recording goes instead if the name is taken.
std::unique_ptr<Recorder> start_recorder(const std::string& file, const LoadedScene& scene, const std::string& role);
// Completes it and says on stderr what was lost, if anything.
void finish_recorder(Recorder* recorder, const StationCounters& counters);

// A number that no earlier start of this station has used, so that the peer notices a restart. Never 0.
std::uint32_t draw_session();

// Without an end of its own: the tick decides, or a signal.
LoopParams loop_params(const scene::Scene& scene, Nanoseconds period, const StopSignals& stop);
void print_loop(const char* role, const RunStats& stats);

}  // namespace farhand
