// What one tick of a scene costs (observe, motion to follow, law, gate), beside the same laws written by hand in plain
// doubles and beside copying what goes in and out. The composed step is to cost at most 1.5 times the hand-written one.
#include <benchmark/benchmark.h>

#include <array>
#include <cmath>
#include <cstring>

#include "common/law/architectures.hpp"
#include "common/station/drive.hpp"
#include "netem/lab/plain_step.hpp"

namespace farhand {
namespace {

// What a tick is given: a slow movement seen by an encoder, and the same from the peer a little later. Long enough that
// no branch predictor learns it by heart.
struct Input {
  double x, f, x_r, v_r, f_r;
};

const std::array<Input, 4096>& inputs() {
  static const std::array<Input, 4096> all = [] {
    std::array<Input, 4096> made;
    const double count = 2 * std::numbers::pi / 20000;
    for (std::size_t k = 0; k < made.size(); ++k) {
      const double p = 2 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(made.size());
      made[k] = {std::round(0.25 * std::sin(p) / count) * count, 0.1 * std::cos(p), 0.25 * std::sin(p - 0.1),
                 0.4 * std::cos(p - 0.1), 0.6 * std::sin(2 * p)};
    }
    return made;
  }();
  return all;
}

ControlParams params() {
  ControlParams p;
  p.drive.model.gravity = 0.3;
  p.drive.model.coulomb = 0.01;
  return p;
}

// As every patient's box is set unless it says otherwise.
ControlParams reference_params() {
  ControlParams p = params();
  p.drive.gate.acceleration = 1000;
  return p;
}

void composed(benchmark::State& state, const char* architecture) {
  const ControlParams p = params();
  DirectDrive<1> drive(p.drive);
  const std::unique_ptr<Law<1>> law = farhand::architecture(architecture).master.make(p.law, p.drive.K, p.drive.dt_s);
  LawInputs<1> to_law;
  to_law.engaged = true;
  drive.reset({});
  law->start(to_law);
  std::size_t k = 0;
  for (auto _ : state) {
    const Input& in = inputs()[k++ % inputs().size()];
    DirectDrive<1>::Sensed sensed;
    sensed.x[0] = in.x;
    to_law.received = {Joints<1>(in.x_r), Joints<1>(in.v_r), Joints<1>(in.f_r)};
    to_law.local = drive.observe(sensed, 1);
    benchmark::DoNotOptimize(drive.follow(to_law.local, law->step(to_law).follow, {}, 1));
    benchmark::DoNotOptimize(drive);
  }
}

// With what every direct drive has besides its law: it looks whether its reading can be right (stuck_reading.hpp), and
// keeps its observers for where it cannot.
template <PlainScene kScene>
void by_hand(benchmark::State& state) {
  const ControlParams p = params();
  const DriveParams& d = p.drive;
  PlainStep<kScene> plain(p), moving(p);
  StuckReading<1> stuck(d.resolution, d.stiffest_nm_per_rad / d.model.J_n, d.g_v, d.g_dis, d.dt_s);
  plain.reset(0.0);
  plain.start(0.0, 0.0, 0.0);
  double tau = 0.0;
  std::size_t k = 0;
  for (auto _ : state) {
    const Input& in = inputs()[k++ % inputs().size()];
    const double known = stuck.stood() > 0 ? moving.tau_dis() : plain.tau_dis();
    if (stuck.step(Joints<1>(in.x), Joints<1>(plain.v), Joints<1>((tau - known) / d.model.J_n))) moving = plain;
    if (stuck.stuck(false)) {
      plain = moving;
    } else {
      plain.observe(in.x);
    }
    benchmark::DoNotOptimize(tau = plain.follow(in.x, in.x_r, in.v_r, in.f_r));
    benchmark::DoNotOptimize(plain);
  }
}

BENCHMARK_CAPTURE(composed, four_channel, "FOUR_CHANNEL");
BENCHMARK(by_hand<PlainScene::kFourChannel>);
BENCHMARK_CAPTURE(composed, cdob, "FOUR_CHANNEL_CDOB");
BENCHMARK(by_hand<PlainScene::kCdob>);
BENCHMARK_CAPTURE(composed, cdob_sdcv, "FOUR_CHANNEL_CDOB_SDCV");
BENCHMARK(by_hand<PlainScene::kCdobSdcv>);

void composed_reference(benchmark::State& state) {
  ReferenceDrive<1> drive(reference_params().drive);
  drive.reset({});
  std::size_t k = 0;
  for (auto _ : state) {
    const Input& in = inputs()[k++ % inputs().size()];
    ReferenceDrive<1>::Sensed sensed;
    sensed.x[0] = in.x;
    sensed.f[0] = in.f;
    const Motion<1> received{Joints<1>(in.x_r), Joints<1>(in.v_r), Joints<1>(in.f_r)};
    const Motion<1> local = drive.observe(sensed, 1);
    benchmark::DoNotOptimize(drive.follow(local, received, {}, 1));
    benchmark::DoNotOptimize(drive);
  }
}
BENCHMARK(composed_reference);

void by_hand_reference(benchmark::State& state) {
  PlainReferenceStep<> plain(reference_params());
  plain.reset(0.0);
  std::size_t k = 0;
  for (auto _ : state) {
    const Input& in = inputs()[k++ % inputs().size()];
    plain.step(in.x, in.x_r, in.v_r, in.f_r);
    benchmark::DoNotOptimize(plain);
  }
}
BENCHMARK(by_hand_reference);

// What goes into a tick and comes out of it, moved and nothing else.
void struct_copy(benchmark::State& state) {
  Input out;
  std::size_t k = 0;
  for (auto _ : state) {
    std::memcpy(&out, &inputs()[k++ % inputs().size()], sizeof out);
    benchmark::DoNotOptimize(out);
  }
}
BENCHMARK(struct_copy);

}  // namespace
}  // namespace farhand
