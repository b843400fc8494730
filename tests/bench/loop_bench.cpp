// What a control period of both sides costs in the bare loop (two laws, delay lines, two plants), and how many scenes
// of 10 s a core runs per second; and whole sessions with their metrics.
#include <benchmark/benchmark.h>

#include "common/config/load.hpp"
#include "common/judge/summary.hpp"
#include "netem/lab/bare_run.hpp"
#include "netem/lab/simulation.hpp"

namespace farhand {
namespace {

const scene::Scene& wall() {
  static const scene::Scene scene = load_scene("four_channel_wall").scene;
  return scene;
}

// One 10 s scene, making it ready included.
void bare_loop(benchmark::State& state, BareMethod method, double step_s) {
  for (auto _ : state) {
    const auto run = make_bare_run(wall(), {method, step_s, 0});
    run->run(ticks_of(wall()));
  }
  state.counters["scenes/s"] = benchmark::Counter(static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}
BENCHMARK_CAPTURE(bare_loop, closed_form, BareMethod::kClosedForm, 0.0)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(bare_loop, rk4_50us, BareMethod::kRk4, 50e-6)->Unit(benchmark::kMillisecond);

// A row of a sweep: the session, its metrics and its text.
void whole_session(benchmark::State& state, const char* name) {
  const LoadedScene loaded = load_scene(name);
  for (auto _ : state) benchmark::DoNotOptimize(metrics_row(compute_metrics(simulate(loaded), loaded.scene)));
  state.counters["sessions/s"] =
      benchmark::Counter(static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}
BENCHMARK_CAPTURE(whole_session, four_channel, "four_channel")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(whole_session, orthosis, "sea_four_channel_mediated")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace farhand
