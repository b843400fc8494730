// The four programs together, undisturbed: they do what virtual time says they do, and their loop threads touch neither
// heap nor mutex.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "common/judge/metrics.hpp"
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
};

Outcome outcome_of(const Session& session, const scene::Scene& scene) {
  const Metrics metrics = compute_metrics(session, scene);
  return {metrics.number("force_ratio"), metrics.number("tracking_rms_rad")};
}

// To the natural end of the scene. A run that a busy machine made hold is another session than the one of virtual time:
// it is told and run again.
Outcome run_processes(const std::string& name, Sets sets) {
  sets.push_back("runtime.priority=20");  // where it is allowed, a busy machine then disturbs little
  const LoadedScene loaded = load_scene(name, sets);
  for (int attempt = 1;; ++attempt) {
    ScratchDirectory scratch;
    {
      SessionProcesses session(scratch.path(), {name, sets, {}, {}});
      EXPECT_EQ(session[Program::kSlave].wait(), 0) << session[Program::kSlave].err();
      EXPECT_EQ(session[Program::kMaster].wait(), 0) << session[Program::kMaster].err();
      session.stop();
    }
    const Session session = merge_recordings(scratch.path());
    const Metrics metrics = compute_metrics(session, loaded.scene);
    const double held_s = metrics.number("held_s");
    if (held_s == 0.0 || attempt == 4) {
      EXPECT_EQ(held_s, 0.0) << "in four attempts";
      return {metrics.number("force_ratio"), metrics.number("tracking_rms_rad")};
    }
    std::printf("attempt %d held for %.3f s\n", attempt, held_s);
  }
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
    const Outcome real = run_processes(name, sets);
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
