// The four programs together, while nothing disturbs them: they do what virtual time says they do, and their loop
// threads touch neither heap nor mutex.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>

#include "common/judge/alignment.hpp"
#include "common/link/packet.hpp"
#include "common/record/merge.hpp"
#include "netem/lab/simulation.hpp"
#include "tests/support/alloc_counter.hpp"
#include "tests/support/scratch_directory.hpp"
#include "tests/support/session_processes.hpp"

namespace farhand {
namespace {

using Sets = std::vector<std::string>;

// The main job in 11 s: shorter free motion, no release.
const Sets kShort{"duration_s=11",
                  "master.therapist.intended[0].duration_s=1.5",
                  "master.therapist.intended[1].duration_s=4",
                  "master.therapist.intended[2].duration_s=1",
                  "slave.hand.from_s=6",
                  "windows.free.from_s=2.5",
                  "windows.free.until_s=5.5",
                  "windows.contact.from_s=8",
                  "windows.contact.until_s=11"};

struct Outcome {
  double force_ratio = 0, tracking_rms_rad = 0;
  std::size_t free_ticks = 0, contact_ticks = 0;
};

// While a PC stood still for 3 ms or more, and a second and a half after that: less of the peer is followed
// (common/station/after_gap.hpp).
std::vector<std::pair<double, double>> disturbed(const AlignedSession& a) {
  std::vector<std::pair<double, double>> out;
  for (const SideCurves* side : {&a.master, &a.slave})
    for (std::size_t k = 1; k < side->t_s.size(); ++k)
      if (side->t_s[k] - side->t_s[k - 1] >= 0.003) out.emplace_back(side->t_s[k - 1], side->t_s[k] + 1.5);
  return out;
}

// Over the ticks that no PC disturbed. How many these are says how busy the machine was, and nothing else.
Outcome outcome_of(const Session& session, const scene::Scene& scene) {
  const AlignedSession a = align(session, scene);
  const auto disturbances = disturbed(a);
  const auto counts = [&](const SideCurves& side, std::size_t k, const scene::Window& window) {
    const double t = side.t_s[k];
    return t >= window.from_s() && t <= window.until_s() && side.state[k] == static_cast<int>(StationState::kEngaged) &&
           std::none_of(disturbances.begin(), disturbances.end(),
                        [t](const auto& span) { return t >= span.first && t <= span.second; });
  };
  Outcome out;
  double square = 0, F_m = 0, F_s = 0;
  for (std::size_t k = 0; k < a.slave.t_s.size(); ++k) {
    if (!counts(a.slave, k, scene.windows().free()) || !std::isfinite(a.tracking_rad[k])) continue;
    square += a.tracking_rad[k] * a.tracking_rad[k];
    ++out.free_ticks;
  }
  out.tracking_rms_rad = std::sqrt(square / static_cast<double>(out.free_ticks));
  Walk at_slave(a.slave.t_s);
  for (std::size_t k = 0; k < a.master.t_s.size(); ++k) {
    if (!counts(a.master, k, scene.windows().contact())) continue;
    const double of_slave = at_slave.interpolate(a.slave.F_nm, a.master.t_s[k]);
    if (!std::isfinite(of_slave)) continue;
    F_m += a.master.F_nm[k];
    F_s += of_slave;
    ++out.contact_ticks;
  }
  out.force_ratio = F_m / F_s;
  return out;
}

// To the natural end of the scene. A machine may be so busy that hardly a tick is undisturbed: that run is told, and
// another is made.
std::optional<Outcome> run_processes(const std::string& name, Sets sets) {
  sets.push_back("runtime.priority=20");  // where it is allowed, a busy machine then disturbs little
  const LoadedScene loaded = load_scene(name, sets);
  for (int attempt = 1; attempt <= 4; ++attempt) {
    ScratchDirectory scratch;
    {
      SessionProcesses session(scratch.path(), {name, sets, {}, {}});
      EXPECT_EQ(session[Program::kSlave].wait(), 0) << session[Program::kSlave].err();
      EXPECT_EQ(session[Program::kMaster].wait(), 0) << session[Program::kMaster].err();
      session.stop();
    }
    const Outcome outcome = outcome_of(merge_recordings(scratch.path()), loaded.scene);
    if (outcome.free_ticks >= 500 && outcome.contact_ticks >= 500) return outcome;
    std::printf("attempt %d: %zu ticks of free motion and %zu of contact were undisturbed\n", attempt,
                outcome.free_ticks, outcome.contact_ticks);
  }
  return std::nullopt;
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

void expect_like_the_lab(const std::string& name, const Sets& sets, int runs) {
  const LoadedScene loaded = load_scene(name, sets);
  const Outcome lab = outcome_of(simulate(loaded), loaded.scene);
  std::vector<double> ratios, trackings;
  for (int i = 0; i < runs; ++i) {
    const std::optional<Outcome> ran = run_processes(name, sets);
    if (!ran) GTEST_SKIP() << "this machine is too busy: in four sessions the programs were hardly left to run";
    const Outcome& real = *ran;
    std::printf("force ratio %.4f (lab %.4f), tracking %.3f mrad RMS (lab %.3f)\n", real.force_ratio, lab.force_ratio,
                1e3 * real.tracking_rms_rad, 1e3 * lab.tracking_rms_rad);
    ratios.push_back(real.force_ratio);
    trackings.push_back(real.tracking_rms_rad);
  }
  EXPECT_NEAR(median(ratios), lab.force_ratio, 0.05);
  EXPECT_NEAR(median(trackings), lab.tracking_rms_rad, 3e-3);
}

TEST(Processes, ForceAndTrackingAreThoseOfVirtualTime) { expect_like_the_lab("demo", kShort, 1); }

TEST(NightlyProcesses, ForceAndTrackingOfTheMainJobAreThoseOfVirtualTime) { expect_like_the_lab("demo", {}, 3); }

TEST(NightlyProcesses, ForceAndTrackingWithoutCompensationAreThoseOfVirtualTime) {
  expect_like_the_lab("sea_four_channel", {}, 3);
}

TEST(Processes, LoopThreadsTouchNeitherHeapNorMutexInTenSeconds) {
  if (kCounterIsBlind) GTEST_SKIP() << "nothing can be counted below a sanitizer";
  ScratchDirectory scratch;
  const std::string counts = (scratch / "counts").string();
  Sets sets = kShort;
  sets.push_back("duration_s=10.2");
  sets.push_back("windows.contact.until_s=10");
  {
    SessionProcesses session(scratch.path(), {"demo",
                                              sets,
                                              {(program_directory() / "libfarhand_count.so").string()},
                                              {"FARHAND_COUNT_FILE=" + counts, "FARHAND_COUNT_TRACE=1"}});
    EXPECT_EQ(session[Program::kSlave].wait(), 0) << session[Program::kSlave].err();
    EXPECT_EQ(session[Program::kMaster].wait(), 0) << session[Program::kMaster].err();
    const Recorded master = session.recorded(Program::kMaster), slave = session.recorded(Program::kSlave);
    for (const auto* rows : {&master.master, &slave.slave}) {
      ASSERT_FALSE(rows->empty());
      EXPECT_GE(rows->back().first - rows->front().first, 10 * kSecond);
      EXPECT_TRUE(std::any_of(rows->begin(), rows->end(), [](const auto& timed) {
        return timed.second.state == static_cast<int>(StationState::kEngaged);
      }));
    }
    const std::string said = file_bytes(counts);
    std::printf("%s", said.c_str());
    for (const Program program : {Program::kMaster, Program::kSlave}) {
      const std::string who = std::string("farhand-count farhand-") + role_of(program) + " pid ";
      const std::size_t line = said.find(who), count = said.find_first_not_of("0123456789", line + who.size());
      ASSERT_NE(line, std::string::npos) << session[program].err();
      EXPECT_EQ(said.substr(count, said.find('\n', count) - count), " heap 0 locks 0") << session[program].err();
    }
    session.stop();
  }
}

}  // namespace
}  // namespace farhand
