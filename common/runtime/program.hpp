// What every farhand program shares: how a scene is chosen, how mistakes are said, how a run ends.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/config/load.hpp"
#include "common/record/recorder.hpp"
#include "common/runtime/run_loop.hpp"

namespace CLI {
class App;
}

namespace farhand {

inline constexpr int kExitOk = 0;             // also when the verdict is degraded
inline constexpr int kExitFailed = 1;         // failed while running
inline constexpr int kExitUsage = 2;          // arguments, scene, files, ports: before anything moved
inline constexpr int kExitVerdictFailed = 3;  // ran to its end, and the verdict is failed
inline constexpr int kExitStopped = 130;      // came to rest after SIGINT or SIGTERM

struct SceneChoice {
  std::string scene;
  std::vector<std::string> sets;
  std::optional<std::uint64_t> seed;

  // Says the scene's warnings on stderr.
  LoadedScene load() const;
};

void add_scene_option(CLI::App& app, SceneChoice& choice);  // --scene
void add_set_options(CLI::App& app, SceneChoice& choice);   // --set, --seed

// Parses, runs the body, and turns what it throws into a sentence and an exit code. A body throws only before its loop.
int run_program(CLI::App& app, int argc, char** argv, const std::function<int()>& body);

// What stands at the head of a recording that begins now.
record::RunInfo run_info(const LoadedScene& scene, const std::string& role);
// Throws std::runtime_error when nothing can be written there: a program that still waits for its peer must say so
// first.
void require_recordable(const std::string& file);
// None without a file name.
std::unique_ptr<Recorder> start_recorder(const std::string& file, const LoadedScene& scene, const std::string& role);
// Completes it and says on stderr what was lost, if anything.
void finish_recorder(Recorder* recorder, const StationCounters& counters);

// A number that no earlier start of this station has used, so that the peer notices a restart. Never 0.
std::uint32_t draw_session();

// Without an end of its own: the tick decides, or a signal.
LoopParams loop_params(const scene::Scene& scene, Nanoseconds period, const StopSignals& stop);
void print_loop(const char* role, const RunStats& stats);

}  // namespace farhand
