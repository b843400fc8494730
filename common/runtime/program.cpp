#include "common/runtime/program.hpp"

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <random>
#include <stdexcept>

#include "common/advice/guarded.hpp"
#include "common/advice/warnings.hpp"
#include "common/config/effect.hpp"
#include "common/law/architectures.hpp"

namespace farhand {

LoadedScene SceneChoice::load() const {
  LoadedScene loaded = load_scene(scene, sets, seed);
  if (real_time) {
    refuse_virtual_time(loaded.scene);
    refuse_unguarded(loaded.scene);
  }
  for (const std::string& warning : warnings(loaded.scene))
    std::fprintf(stderr, "%s: warning: %s\n", loaded.path.c_str(), warning.c_str());
  return loaded;
}

namespace {

void add_set_options(Command command, SceneChoice& choice) {
  command.texts("--set", choice.sets, "field.path=value, on top of the scene; may be repeated");
  command.seed("--seed", choice.seed, "seed of every random choice, instead of the scene's");
}

}  // namespace

void add_scene_option(Command command, SceneChoice& choice) {
  choice.real_time = true;
  command.input("--scene", choice.scene, "name of a shipped scene, or path of a scene file", Needed::kYes);
  add_set_options(command, choice);
}

void add_scene_argument(Command command, SceneChoice& choice) {
  command.input("SCENE", choice.scene, "name of a shipped scene, or path of a scene file", Needed::kYes);
  add_set_options(command, choice);
}

record::RunInfo run_info(const LoadedScene& scene, const std::string& role) {
  record::RunInfo info;
  info.set_scene_name(scene.name);
  info.set_scene_text(complete_text(scene.scene));
  info.set_seed(scene.scene.seed());
  info.set_role(role);
  info.set_program_version(FARHAND_VERSION);
  info.set_start_ns(monotonic_now());
  const auto utc = std::chrono::system_clock::now().time_since_epoch();
  info.set_start_utc_ns(std::chrono::duration_cast<std::chrono::nanoseconds>(utc).count());
  info.set_clock_id(host_clock_id());
  const Architecture& laws = architecture(scene::Architecture_Name(scene.scene.architecture()));
  name_signals(names_of(laws.master.signals), names_of(laws.slave.signals), info);
  return info;
}

std::unique_ptr<Recorder> start_recorder(const std::string& file, const LoadedScene& scene, const std::string& role,
                                         const DeviceFriction& friction) {
  if (file.empty()) return nullptr;
  if (file == "-") throw std::invalid_argument("--record -: a session is recorded to a file");
  record::RunInfo info = run_info(scene, role);
  encode(friction, info);
  auto recorder = std::make_unique<Recorder>(file, info);
  for (const std::filesystem::path& there : recorder->file().in_the_way()) {
    if (there.extension() == ".part")
      std::fprintf(stderr, "recording: %s is of a run that did not end; farhand-lab recording recover completes it\n",
                   there.c_str());
  }
  if (const std::string sentence = other_name(recorder->file()); !sentence.empty())
    std::fprintf(stderr, "recording: %s\n", sentence.c_str());
  return recorder;
}

void finish_recorder(Recorder* recorder, const StationCounters& counters, const DeviceFriction& friction) {
  if (recorder == nullptr) return;
  const RecordingOutcome outcome = recorder->finish(counters, friction);
  if (!outcome.problem.empty()) std::fprintf(stderr, "recording: %s\n", outcome.problem.c_str());
  if (outcome.overflow + outcome.unwritten > 0) {
    std::fprintf(stderr,
                 "recording: %llu samples found the ring full and %llu found no room on the disk; %s lacks them\n",
                 static_cast<unsigned long long>(outcome.overflow), static_cast<unsigned long long>(outcome.unwritten),
                 outcome.file.c_str());
  }
}

std::uint32_t draw_session() {
  std::random_device entropy;
  std::uint32_t session = 0;
  while (session == 0) session = entropy();
  return session;
}

LoopParams loop_params(const scene::Scene& scene, Nanoseconds period, const StopSignals& stop) {
  LoopParams params;
  params.period_ns = period;
  params.realtime.fifo_priority = static_cast<int>(scene.runtime().priority());
  params.realtime.lock_memory = scene.runtime().lock_memory();
  params.stop = &stop;
  return params;
}

void print_loop(const char* role, const RunStats& stats) {
  std::printf(
      "farhand-%s: %llu ticks, %llu overran their period, %llu deadlines skipped; tick p50 %.0f, p99 %.0f, max %.0f "
      "us\n",
      role, static_cast<unsigned long long>(stats.ticks), static_cast<unsigned long long>(stats.overruns),
      static_cast<unsigned long long>(stats.missed), 1e-3 * static_cast<double>(stats.tick_duration.quantile(0.5)),
      1e-3 * static_cast<double>(stats.tick_duration.quantile(0.99)),
      1e-3 * static_cast<double>(stats.tick_duration.max()));
}

}  // namespace farhand
