// Two pieces of work side by side, one ratio for each pair, and the recorded session that they work on.
#pragma once

#include <benchmark/benchmark.h>

#include <algorithm>
#include <ctime>

#include "common/config/load.hpp"
#include "common/config/station_params.hpp"
#include "netem/lab/simulation.hpp"
#include "netem/lab/station_inputs.hpp"

namespace farhand {

inline double thread_ns() {
  timespec now{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e9 * static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec);
}

template <class Work>
double time_of(Work&& work) {
  const double start = thread_ns();
  work();
  return thread_ns() - start;
}

inline double quantile(std::vector<double> values, double q) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

template <class Without, class Never>
void compare(benchmark::State& state, std::size_t ticks, Without&& without, Never&& never) {
  without();
  never();
  std::vector<double> with_ns, never_ns, ratios;
  for (auto _ : state) {
    double a = 0, b = 0;
    if (ratios.size() % 2 == 0) {
      a = time_of(without);
      b = time_of(never);
    } else {
      b = time_of(never);
      a = time_of(without);
    }
    with_ns.push_back(a / static_cast<double>(ticks));
    never_ns.push_back(b / static_cast<double>(ticks));
    ratios.push_back(a / b);
    state.SetIterationTime((a + b) * 1e-9);
  }
  state.counters["without_ns"] = quantile(with_ns, 0.5);
  state.counters["never_ns"] = quantile(never_ns, 0.5);
  state.counters["ratio"] = quantile(ratios, 0.5);
  state.counters["ratio_q1"] = quantile(ratios, 0.25);
  state.counters["ratio_q3"] = quantile(ratios, 0.75);
}

inline constexpr int kPairs = 101;

struct Recorded {
  LoadedScene loaded = load_scene("zero_delay", std::vector<std::string>{"windows={}", "duration_s=4"});
  Session session = simulate(loaded);
  std::vector<Arrival> arrivals = arrivals_of(session, true);
  StationParams params = master_station_params(loaded.scene, kMasterSession);
};

inline const Recorded& recorded() {
  static const Recorded all;
  return all;
}

inline OperatorAct act_at(const StationSample& row) {
  return row.t_s == 0.2 ? OperatorAct::kEngage : OperatorAct::kNone;
}

}  // namespace farhand
