// What a scene leaves out costs nothing: each whole without a block beside one that never had a place for it, written
// by hand. The two are run in turn, in changing order, and each pair gives one ratio, so that a machine that gets
// slower in the middle slows both. Time is that of the thread: what others do meanwhile is not in it.
//
// Objects begin at a cache line, because one that happens to straddle two can cost more than any block.
//
//   never_ns, without_ns: per tick, medians; ratio: median of the pairs, and its quartiles
#include "common/runtime/owned_station.hpp"
#include "tests/bench/paired.hpp"

namespace farhand {
namespace {

void run_whole(Station<DirectIo<1>>& station) {
  through(station, recorded().session.master, recorded().arrivals, [&](Nanoseconds now, const StationSample& row) {
    DirectIo<1>::Sensed sensed;
    sensed.x[0] = row.x_rad;
    benchmark::DoNotOptimize(station.tick(now, sensed, act_at(row)));
  });
}

StationParams params_of(const char* architecture) {
  StationParams p = recorded().params;
  p.architecture = architecture;
  return p;
}

// How far from 1 two of the same are, which lie at different places: the noise of what follows.
void station_twice(benchmark::State& state) {
  const Recorded& r = recorded();
  const auto once = [] {
    alignas(64) OwnedStation<DirectIo<1>> station(params_of("FOUR_CHANNEL"));
    run_whole(station);
  };
  compare(state, r.session.master.size(), once, once);
}
BENCHMARK(station_twice)->Iterations(kPairs)->UseManualTime();

// What the two compensations cost where they are there. A station knows no architecture: without them there is nothing
// of them in it.
void station_with(benchmark::State& state, const char* architecture) {
  const Recorded& r = recorded();
  compare(
      state, r.session.master.size(),
      [&] {
        alignas(64) OwnedStation<DirectIo<1>> station(params_of(architecture));
        run_whole(station);
      },
      [&] {
        alignas(64) OwnedStation<DirectIo<1>> station(params_of("FOUR_CHANNEL"));
        run_whole(station);
      });
}
BENCHMARK_CAPTURE(station_with, cdob, "FOUR_CHANNEL_CDOB")->Iterations(kPairs)->UseManualTime();
BENCHMARK_CAPTURE(station_with, cdob_sdcv, "FOUR_CHANNEL_CDOB_SDCV")->Iterations(kPairs)->UseManualTime();

// RTOB of an axis on which nothing but viscous friction is known.
class ViscousRtob {
 public:
  ViscousRtob(const AxisModel& model, Cutoff g, double dt_s) : viscous_(model.viscous), observer_(model.J_n, g, dt_s) {}
  const Joints<1>& step(const Joints<1>& tau_applied, const Joints<1>& v) noexcept {
    return observer_.step(tau_applied - viscous_ * v, v);
  }

 private:
  double viscous_;
  Dob<1> observer_;
};

// An observer that knows of neither weight nor dry friction, beside one that never could.
void rtob_without_weight_and_friction(benchmark::State& state) {
  const Recorded& r = recorded();
  const AxisModel model = r.params.control.drive.model;
  alignas(64) Rtob<1> without(model, Cutoff::rad_s(200.0), 1e-3);
  alignas(64) ViscousRtob never(model, Cutoff::rad_s(200.0), 1e-3);
  const auto each = [&](auto&& step) {
    for (const StationSample& row : r.session.master)
      benchmark::DoNotOptimize(step(Joints<1>(row.command_nm), Joints<1>(row.x_rad), Joints<1>(row.v_rad_s)));
  };
  compare(
      state, r.session.master.size(),
      [&] { each([&](const auto& tau, const auto& x, const auto& v) { return without.step(tau, x, v); }); },
      [&] { each([&](const auto& tau, const auto&, const auto& v) { return never.step(tau, v); }); });
}
BENCHMARK(rtob_without_weight_and_friction)->Iterations(kPairs)->UseManualTime();

}  // namespace
}  // namespace farhand
