// Code that all farhand programs share: choice of a scene, reports of mistakes, end of a run.
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

  // Prints the scene's warnings on stderr. In real time, settings that only virtual time can follow throw
  // std::invalid_argument.
  LoadedScene load() const;
};

void add_scene_option(Command command, SceneChoice& choice);    // --scene, --set, --seed; in real time
void add_scene_argument(Command command, SceneChoice& choice);  // SCENE, --set, --seed

// The head of a recording that begins now.
record::RunInfo run_info(const LoadedScene& scene, const std::string& role);
// Null without a file name. If the name is taken, prints the new name on stderr.
std::unique_ptr<Recorder> start_recorder(const std::string& file, const LoadedScene& scene, const std::string& role,
                                         const DeviceFriction& friction = {});
// Completes the recording and prints losses on stderr.
void finish_recorder(Recorder* recorder, const StationCounters& counters, const DeviceFriction& friction = {});

// Draws a number that no earlier start of this station has used, so that the peer notices a restart. Never 0.
std::uint32_t draw_session();

// A loop without a fixed end: the tick ends it, or a signal.
LoopParams loop_params(const scene::Scene& scene, Nanoseconds period, const StopSignals& stop);
void print_loop(const char* role, const RunStats& stats);

}  // namespace farhand
