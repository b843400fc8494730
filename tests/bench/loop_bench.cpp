// What a control period of both sides costs in the bare loop (two laws, delay lines, two plants), and how many scenes
// of 10 s a core runs per second: composed of the product's blocks, by hand, and four at a time.
#include <benchmark/benchmark.h>

#include "common/config/load.hpp"
#include "netem/lab/bare_run.hpp"
#include "netem/lab/sweep.hpp"

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

void lock_step(benchmark::State& state) {
  const std::vector<scene::Scene> four(LockStep::kScenes, wall());
  for (auto _ : state) {
    const auto run = make_lock_step(four);
    run->run();
    benchmark::DoNotOptimize(run->outcomes());
  }
  state.counters["scenes/s"] = benchmark::Counter(
      static_cast<double>(state.iterations()) * static_cast<double>(LockStep::kScenes), benchmark::Counter::kIsRate);
}
BENCHMARK(lock_step)->Unit(benchmark::kMillisecond);

// The argument is the number of threads.
void many_scenes(benchmark::State& state) {
  constexpr std::size_t kCount = 400;
  for (auto _ : state) {
    benchmark::DoNotOptimize(sweep(
        kCount, [](std::size_t) { return wall(); }, static_cast<int>(state.range(0))));
  }
  state.counters["scenes/s"] = benchmark::Counter(static_cast<double>(state.iterations()) * static_cast<double>(kCount),
                                                  benchmark::Counter::kIsRate);
}
BENCHMARK(many_scenes)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace farhand
