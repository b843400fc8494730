// What a tick of 1 ms of a world costs: closed form beside Runge-Kutta in steps of 50 us.
#include <benchmark/benchmark.h>

#include <numbers>

#include "common/integrate/closed_form.hpp"
#include "common/integrate/integrator.hpp"
#include "common/integrate/rk4.hpp"
#include "common/plant/axis_plant.hpp"
#include "common/plant/series_elastic_plant.hpp"

namespace farhand {
namespace {

template <class P>
using RungeKutta = Integrator<Rk4, P>;

// `input` says what is held in each tick.
template <class P, class Solver, class Input>
void tick(benchmark::State& state, const typename P::Params& params, typename P::State begin, Input input) {
  P plant(params);
  Solver solver(IntegratorSettings{});
  std::int64_t k = 0;
  for (auto _ : state) {
    if (k % 10'000 == 0) {  // every run of 10 s begins anew, as scenes do
      k = 0;
      solver.start(plant, 0.0, begin);
    }
    plant.hold(input(k, solver.state()));
    solver.advance(plant, static_cast<double>(++k) * 1e-3);
    benchmark::DoNotOptimize(solver.state());
  }
  if (solver.status() != IntegratorStatus::kOk) state.SkipWithError("did not stay good");
  state.counters["events"] = static_cast<double>(solver.counters().events) / static_cast<double>(k);
}

// Around 0, far from the stops, by a torque that changes in every tick.
constexpr auto kToAndFro = [](std::int64_t k, const auto& x) { return (k % 2 == 0 ? 1e-3 : -1e-3) - 0.1 * x[0]; };

template <template <class> class Solver>
void free_slave(benchmark::State& state) {
  tick<DirectSlavePlant, Solver<DirectSlavePlant>>(state, {}, {0.05, 0}, kToAndFro);
}
template <template <class> class Solver>
void slave_in_hand(benchmark::State& state) {
  DirectSlavePlant::Params params;
  params.load.hand.emplace();
  tick<DirectSlavePlant, Solver<DirectSlavePlant>>(state, params, {0.05, 0}, kToAndFro);
}
template <template <class> class Solver>
void slave_on_wall(benchmark::State& state) {  // pressed on 1e4 N m/rad with a force that trembles
  DirectSlavePlant::Params params;
  params.load.wall = Wall::Params{.stiffness = 1e4, .damping = 4, .at = 0.1};
  tick<DirectSlavePlant, Solver<DirectSlavePlant>>(
      state, params, {0.1, 0}, [](std::int64_t k, const auto&) { return 1.0 + (k % 2 == 0 ? 0.01 : -0.01); });
}
template <template <class> class Solver>
void slave_bouncing(benchmark::State& state) {  // events in every tick: to the wall and off again by the held torque
  DirectSlavePlant::Params params;
  params.load.wall = Wall::Params{.stiffness = 1e6, .damping = 0, .at = 0.1};
  tick<DirectSlavePlant, Solver<DirectSlavePlant>>(state, params, {0.0999, 0.5},
                                                   [](std::int64_t, const auto&) { return 4.0; });
}
template <template <class> class Solver>
void master_at_rest(benchmark::State& state) {
  tick<MasterPlant, Solver<MasterPlant>>(state, {}, {0.05, 0}, kToAndFro);
}
template <template <class> class Solver>
void master_in_minimum_jerk(benchmark::State& state) {
  MasterPlant::Params params;
  params.load.intended = {Movement::ramp(0.2, 10)};
  tick<MasterPlant, Solver<MasterPlant>>(state, params, {0, 0}, kToAndFro);
}
template <template <class> class Solver>
void master_in_sine(benchmark::State& state) {
  MasterPlant::Params params;
  params.load.intended = {Movement::sine(0.1, 0.5, 10)};
  tick<MasterPlant, Solver<MasterPlant>>(state, params, {0, 0}, kToAndFro);
}
template <template <class> class Solver>
void series_elastic(benchmark::State& state) {
  tick<SeriesElasticPlant, Solver<SeriesElasticPlant>>(state, {}, {0.05, 0, 0.05, 0}, kToAndFro);
}

template <class P>
using Exact = ClosedForm<P>;

BENCHMARK(free_slave<Exact>);
BENCHMARK(free_slave<RungeKutta>);
BENCHMARK(slave_in_hand<Exact>);
BENCHMARK(slave_in_hand<RungeKutta>);
BENCHMARK(slave_on_wall<Exact>);
BENCHMARK(slave_on_wall<RungeKutta>);
BENCHMARK(slave_bouncing<Exact>);
BENCHMARK(slave_bouncing<RungeKutta>);
BENCHMARK(master_at_rest<Exact>);
BENCHMARK(master_at_rest<RungeKutta>);
BENCHMARK(master_in_minimum_jerk<Exact>);
BENCHMARK(master_in_minimum_jerk<RungeKutta>);
BENCHMARK(master_in_sine<Exact>);
BENCHMARK(master_in_sine<RungeKutta>);
BENCHMARK(series_elastic<Exact>);
BENCHMARK(series_elastic<RungeKutta>);

}  // namespace
}  // namespace farhand
