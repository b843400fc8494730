// Two ways out of the delay, each as real processes through the shim, in one report with the lab.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>

#include "netem/lab/compare.hpp"
#include "netem/lab/compare_report.hpp"
#include "tests/support/scratch_directory.hpp"
#include "tests/support/session_processes.hpp"
#include "tests/support/well_formed.hpp"

namespace farhand {
namespace {

const std::vector<std::string> kSets{
    "runtime.priority=20"};  // where it is allowed, a busy machine then disturbs little

// To the natural end of the scene. A run that a busy machine made hold is another session than the one of virtual time:
// it is told and run again.
std::string run_processes(const ScratchDirectory& scratch, const std::string& name) {
  for (int attempt = 1;; ++attempt) {
    const std::filesystem::path directory = scratch / (name + "-" + std::to_string(attempt));
    std::filesystem::create_directories(directory);
    {
      SessionProcesses session(directory, {name, kSets, {}, {}});
      EXPECT_EQ(session[Program::kSlave].wait(), 0) << session[Program::kSlave].err();
      EXPECT_EQ(session[Program::kMaster].wait(), 0) << session[Program::kMaster].err();
      session.stop();
    }
    const double held_s = compared_sessions({{directory.string()}, {}, {}, false})[0].metrics.number("held_s");
    if (held_s == 0.0 || attempt == 4) {
      EXPECT_EQ(held_s, 0.0) << "in four attempts";
      return directory.string();
    }
    std::printf("attempt %d held for %.3f s\n", attempt, held_s);
  }
}

// FARHAND_REPORT=PATH keeps the page for looking at.
TEST(NightlyProcesses, ModelMediatedAndCdobWithSdcvFeelAsTheyDoInTheLab) {
  const ScratchDirectory scratch;
  const std::string mediated = run_processes(scratch, "four_channel_mediated");
  const std::string sdcv = run_processes(scratch, "four_channel_cdob_sdcv");
  const std::vector<ComparedSession> all =
      compared_sessions({{mediated, sdcv, "four_channel_mediated", "four_channel_cdob_sdcv"}, {}, {}, false});
  std::printf("%s", comparison_text(all).c_str());
  const std::string html = comparison_html(all);
  EXPECT_TRUE(well_formed(html));
  if (const char* path = std::getenv("FARHAND_REPORT")) std::ofstream(path) << html;

  const std::vector<SteadyDifference> differences = steady_differences(all);
  ASSERT_EQ(differences.size(), 2u);
  for (std::size_t k : {0u, 1u}) {
    EXPECT_EQ(differences[k].processes, k);
    EXPECT_EQ(differences[k].lab, k + 2);
    EXPECT_LE(std::abs(differences[k].force_ratio), 0.05) << all[k].name << differences[k].absent_because;
    const Metrics& real = all[k].metrics;
    EXPECT_TRUE(real.is_true("stable")) << all[k].name;
    EXPECT_NEAR(real.number("tracking_rms_rad"), all[k + 2].metrics.number("tracking_rms_rad"), 3e-3) << all[k].name;
    for (const char* way : {"delay_forward_median_ms", "delay_backward_median_ms"})
      EXPECT_NEAR(real.number(way), 100.0, 2.0) << all[k].name << ", as the shim was told";
  }
}

}  // namespace
}  // namespace farhand
