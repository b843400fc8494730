// Hosts that stall, as the scene asks for: when, and what goes on meanwhile.
#include "netem/lab/host_stalls.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "netem/lab/bare_run.hpp"
#include "netem/lab/simulation.hpp"

namespace farhand {
namespace {

const std::string kBase = "architecture: FOUR_CHANNEL duration_s: 3\n";

scene::Scene with(const std::string& more) { return load_scene_text(kBase + more, "text").scene; }

// Of each ms.
std::vector<bool> stalled(const scene::Scene& scene, bool master, int ms) {
  HostStalls stalls(scene, master);
  std::vector<bool> all;
  for (int k = 0; k < ms; ++k) all.push_back(stalls.at(k * kMillisecond));
  return all;
}

TEST(HostStalls, PeriodicOnesBeginWhenTheSceneSays) {
  const auto all = stalled(with("master { host { stall_s: 0.008 every_s: 0.06 from_s: 0.1 } }"), true, 1000);
  for (int k = 0; k < 1000; ++k) EXPECT_EQ(all[static_cast<std::size_t>(k)], k >= 100 && (k - 100) % 60 < 8) << k;
}

TEST(HostStalls, OneSideDoesNotStallTheOther) {
  const scene::Scene scene = with("master { host { stall_s: 0.008 } }");
  for (const bool stalls : stalled(scene, false, 1000)) EXPECT_FALSE(stalls);
}

TEST(HostStalls, RandomOnesComeFromTheSeedAndAreAsLongAndAsOftenAsAskedFor) {
  const std::string host = "host { stall_s: 0.02 every_s: 0.1 random: true from_s: 1 }";
  scene::Scene scene = with("slave { " + host + " } master { " + host + " }");
  const auto all = stalled(scene, false, 100'000);
  EXPECT_EQ(all, stalled(scene, false, 100'000));
  EXPECT_NE(all, stalled(scene, true, 100'000));
  int begun = 0, longest = 0, length = 0;
  for (std::size_t k = 0; k < all.size(); ++k) {
    length = all[k] ? length + 1 : 0;
    longest = std::max(longest, length);
    begun += length == 1 ? 1 : 0;
    EXPECT_FALSE(all[k] && k < 1000);
  }
  // 990 of them, +-3 deviations of a Poisson process at least; some are too short to meet a tick, some meet.
  EXPECT_GT(begun, 800);
  EXPECT_LT(begun, 1085);
  EXPECT_GE(longest, 18);
  EXPECT_LE(longest, 40);
  scene.set_seed(2);
  EXPECT_NE(all, stalled(scene, false, 100'000));
}

TEST(HostStalls, TicksAreSkippedAndTheDeviceGoesOn) {
  class Eyes final : public Witness {
   public:
    void ticked(bool master, const Side& side, double t_s, OperatorAct) override {
      if (!master) ran.push_back(t_s), x = side.truth().x;
    }
    void stalled(bool master, const Side& side, double t_s) override {
      EXPECT_FALSE(master);
      stalls.push_back(t_s);
      moved = moved || side.truth().x != x;
      x = side.truth().x;
    }
    std::vector<double> ran, stalls;
    double x = 0;
    bool moved = false;
  } eyes;
  LoadedScene loaded;
  loaded.scene = with(
      "slave { host { stall_s: 0.05 every_s: 0.5 from_s: 1 } }\n"
      "master { therapist { grip: FIRM intended { duration_s: 3 sine_amplitude_rad: 0.2 } } }\n"
      "operator_acts { at_s: 0.2 act: ENGAGE }");
  const RunCounters counters = simulate(loaded, make_sides(loaded.scene), eyes);
  EXPECT_EQ(counters.slave.missed_ticks, 201u);  // four of 50 ms, and the tick at 3 s
  EXPECT_EQ(counters.master.missed_ticks, 0u);
  EXPECT_EQ(eyes.stalls.size(), 201u);
  EXPECT_EQ(counters.slave.ticks, eyes.ran.size());
  EXPECT_EQ(eyes.ran.size() + eyes.stalls.size(), 3001u);
  EXPECT_TRUE(eyes.moved);
}

TEST(HostStalls, WhatRunsEveryTickRefusesThem) {
  const scene::Scene scene = with("slave { host { stall_s: 0.05 every_s: 0.5 } }");
  try {
    make_bare_run(scene, {BareMethod::kWorld, 0, 0});
    FAIL();
  } catch (const std::invalid_argument& refused) {
    EXPECT_STREQ(refused.what(),
                 "slave.host: the bare loop runs every tick and stalls no host; leave the field out, or use "
                 "farhand-lab run");
  }
}

}  // namespace
}  // namespace farhand
