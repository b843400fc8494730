// Two channels and wave variables: the laws against their closed forms, over delays, jitter and loss.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <deque>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "common/advice/scene_loops.hpp"
#include "common/judge/metrics.hpp"
#include "common/law/wave_variables.hpp"
#include "netem/lab/simulation.hpp"
#include "tests/support/session_metrics.hpp"

namespace farhand {
namespace {

using J1 = Joints<1>;
constexpr double kTick = 1e-3;

// A line of `delay` ticks each way in which every signal is drawn from a seed: V_m and x_s wander.
struct Line {
  WaveParams p;
  int delay = 40;
  MasterWave<1> master{p};
  SlaveWave<1> slave{p, kTick};
  std::deque<double> there = std::deque<double>(static_cast<std::size_t>(delay), 0.0), back = there;
  std::mt19937_64 random{5};
  double V_m = 0, x_m = 0, v_m = 0, v_s = 0, V_s = 0, x_s = 0;
  double x_m_there = 0;  // integral of V_m, one way ago
  std::deque<double> past = there;

  double unit() { return 2.0 * static_cast<double>(random() >> 11) * 0x1p-53 - 1.0; }
  void step() {
    V_m += 0.05 * unit() - 0.01 * V_m;
    V_s += 0.05 * unit() - 0.01 * V_s - 0.01 * x_s;
    x_s += kTick * V_s;
    const auto through = [](std::deque<double>& line, double in) {
      line.push_back(in);
      const double out = line.front();
      line.pop_front();
      return out;
    };
    // What left `delay` ticks ago; this tick's waves leave at its end.
    v_m = back.front();
    v_s = there.front();
    master.step(J1(V_m), J1(v_m));
    slave.step({J1(x_s), J1(V_s), J1(0.0)}, J1(v_s), J1(x_m), 1);
    x_m_there += kTick * past.front();
    through(past, V_m);
    through(there, master.sent()[0]);
    through(back, slave.sent()[0]);
    x_m += kTick * V_m;
  }
};

TEST(Wave, PowerIsWhatTheWavesCarry) {
  Line line;
  double largest = 0;
  for (int k = 0; k < 20'000; ++k) {
    line.step();
    const double power = line.master.force()[0] * line.V_m - line.slave.force()[0] * line.slave.V_sd()[0];
    const double u_m = line.master.sent()[0], u_s = line.slave.sent()[0];
    const double waves = 0.5 * (u_m * u_m - line.v_m * line.v_m + u_s * u_s - line.v_s * line.v_s);
    ASSERT_NEAR(power, waves, 1e-12);
    largest = std::max(largest, std::abs(power));
  }
  EXPECT_GT(largest, 0.01);
}

// Daud 2011, 4.69 and 4.70, sum by sum: what the slave's place differs from the master's by.
TEST(Wave, MatchedEndsDriftAsTheThesisSays) {
  for (const Matching matching : {Matching::kSlave, Matching::kBoth}) {
    Line line{.p = {.matching = matching}};
    const double b = line.p.b;
    std::vector<double> F;
    double sum = 0, recent = 0, farthest = 0;
    for (int k = 0; k < 20'000; ++k) {
      line.step();
      F.push_back(line.slave.force()[0]);
      sum += kTick * F.back();
      recent += kTick * F.back();
      if (k >= 2 * line.delay) recent -= kTick * F[static_cast<std::size_t>(k - 2 * line.delay)];
      const double x_sd = line.slave.x_sd()[0], apart = line.x_m_there - x_sd;
      ASSERT_NEAR(apart, matching == Matching::kSlave ? recent / (2 * b) : sum / b + x_sd, 1e-10) << k;
      farthest = std::max(farthest, std::abs(apart));
    }
    EXPECT_GT(farthest, 0.01);
  }
}

// The integral of the wave comes as play-out shows it: late packets and lost ones take nothing away.
TEST(Wave, WhatAGapHeldBackIsGivenBackSlowly) {
  ReceivedWave<1> received(kTick);
  received.reset(J1(7.0));
  double integral = 7.0, shown = integral, taken = 0, largest = 0;
  for (int k = 0; k < 3000; ++k) {
    const double wave = k < 1030 ? 1.0 : 0.5;  // it changes within the gap
    integral += kTick * wave;
    const bool gap = k >= 1000 && k < 1060;
    if (!gap) shown = integral;
    const double now = received.step(J1(shown), 1, gap)[0];
    taken += kTick * now;
    largest = std::max(largest, std::abs(now));
    if (gap && k > 1000) {
      EXPECT_NEAR(now, 1.0, 1e-12) << "goes on as it was";
    }
  }
  EXPECT_NEAR(taken, integral - 7.0, 1e-9);
  EXPECT_LT(largest, 1.1);
}

TEST(Wave, MissedTicksAreOneLongTick) {
  ReceivedWave<1> received(kTick);
  received.reset(J1(0.0));
  EXPECT_NEAR(received.step(J1(0.002), 1, false)[0], 2.0, 1e-12);
  EXPECT_NEAR(received.step(J1(0.012), 5, false)[0], 2.0, 1e-12);
}

std::vector<std::string> paths(double there_s, double back_s, const std::string& more = "") {
  return {"network.forward={delay_s: " + number(there_s) + more + "}",
          "network.backward={delay_s: " + number(back_s) + more + "}"};
}

// 1/k_seen = 1/k + 1/K_s + R/(2 b), whatever is matched at the slave; with a drift towards the master's angle R/(2 b)
// goes away.
TEST(WaveSessions, AHandIsFeltAsSoftAsItsClosedFormSays) {
  double worst = 0;
  for (const double k : {0.5, 2.0, 5.0}) {
    for (const double one_way : {0.05, 0.15}) {
      for (const char* matching : {"NO_END", "SLAVE_END"}) {
        for (const double drift : {0.0, 1.0}) {
          std::vector<std::string> sets = paths(one_way, one_way);
          sets.push_back("slave.hand.stiffness_nm_per_rad=" + number(k));
          sets.push_back(std::string("control.wave_matching=") + matching);
          sets.push_back("control.wave_drift_per_s=" + number(drift));
          const Metrics metrics = run("wave", sets);
          const double seen = 1 / (1 / k + 1 / 5.0 + (drift > 0 ? 0 : 2 * one_way / (2 * 0.2)));
          const std::string cell = number(k) + " " + number(one_way) + " " + matching + " " + number(drift);
          EXPECT_TRUE(metrics.is_true("stable")) << cell;
          EXPECT_NEAR(metrics.number("force_ratio"), 1.0, 0.005) << cell;
          EXPECT_NEAR(metrics.number("k_seen_ratio"), seen / k, 0.005 * seen / k) << cell;
          worst = std::max(worst, std::abs(metrics.number("k_seen_ratio") * k / seen - 1));
        }
      }
    }
  }
  std::printf("k_seen off by at most %.3f %%\n", 100 * worst);
}

// Jitter makes the round trip longer, by the depth of the play-out; loss takes nothing.
TEST(WaveSessions, NeitherJitterNorLossMakesItDrift) {
  for (const char* matching : {"NO_END", "SLAVE_END"}) {
    for (const char* seed : {"1", "2", "3"}) {
      std::vector<std::string> sets = paths(0.1, 0.1, " jitter_s: 0.05 distribution: UNIFORM loss: 0.1");
      sets.push_back(std::string("control.wave_matching=") + matching);
      sets.push_back(std::string("seed=") + seed);
      const Metrics metrics = run("wave", sets);
      const double R = 0.3, seen = 1 / (1 / 2.0 + 1 / 5.0 + R / (2 * 0.2));
      EXPECT_TRUE(metrics.is_true("stable"));
      EXPECT_NEAR(metrics.number("force_ratio"), 1.0, 0.005);
      EXPECT_NEAR(metrics.number("k_seen_ratio"), seen / 2, 0.01 * seen / 2);
    }
  }
}

// Matched at both ends the slave goes half the way and gives way for ever; a drift towards the master's angle ends
// that.
TEST(WaveSessions, MatchedAtBothEndsItGivesWayForEverAndADriftBackEndsThat) {
  const auto last_angles = [](const char* drift) {
    const LoadedScene loaded =
        load_scene("wave", std::vector<std::string>{"control.wave_matching=BOTH_ENDS",
                                                    std::string("control.wave_drift_per_s=") + drift,
                                                    "slave.hand.stiffness_nm_per_rad=0.5"});
    const Session session = simulate(loaded);
    return std::pair(session.slave[session.slave.size() - 3000].true_x_rad, session.slave.back().true_x_rad);
  };
  const auto [before, last] = last_angles("0");
  EXPECT_LT(std::abs(last), 0.01) << "the hand has pushed it back to where it rests";
  EXPECT_LE(std::abs(last), std::abs(before) + 1e-4);
  EXPECT_GT(std::abs(last_angles("1").second), 0.02);
}

int first_unstable(int from, const std::function<bool(int)>& stable) {
  constexpr int kLongest = 250;
  while (from < kLongest && stable(from)) ++from;
  return from;
}

// Where the roots say that the loop stops being stable, sessions do: the limit is looked for tick by tick.
TEST(TwoChannelSessions, StayStableUpToTheRoundTripOfTheRoots) {
  struct Case {
    double k, K_2;
    const char* grip;
  };
  for (const Case& c : {Case{5, 5, "NORMAL"}, {2, 5, "NORMAL"}, {5, 8, "NORMAL"}, {2, 8, "FIRM"}}) {
    const auto sets = [&](int ticks) {
      std::vector<std::string> all = paths(ticks / 2 * kTick, (ticks - ticks / 2) * kTick);
      for (const std::string& set :
           {"slave.hand.stiffness_nm_per_rad=" + number(c.k), "control.K_2_nm_per_rad=" + number(c.K_2),
            std::string("master.therapist.grip=") + c.grip, std::string("slave.shaking_limit_rad_s=100"),
            std::string("duration_s=20"), std::string("windows.contact.until_s=20")}) {
        all.push_back(set);
      }
      return all;
    };
    // A session is called stable if what moves is halved in 2 s.
    const auto all_within = [&](double halved_in_s) {
      return first_unstable(4, [&](int ticks) {
        const LoadedScene loaded = load_scene("two_channel", sets(ticks));
        const double factor = std::exp2(-kTick / halved_in_s);
        return growing_motions(two_channels(loaded.scene, contacts(loaded.scene).at(1)), factor) == 0;
      });
    };
    const int soon = all_within(2.0), ever = all_within(1e9);
    const int found =
        first_unstable(soon * 4 / 5, [&](int ticks) { return run("two_channel", sets(ticks)).is_true("stable"); });
    std::printf("k %.3g, K_2 %.3g, %s: by the roots unstable from %d ms on, slow from %d; sessions from %d ms\n", c.k,
                c.K_2, c.grip, ever, soon, found);
    EXPECT_GE(found, soon - 1);
    EXPECT_LE(found, ever + 1);
    EXPECT_LE(ever - soon, 5);
  }
}

// 1/k_seen = 1/k + 1/K_2.
TEST(TwoChannelSessions, AHandIsFeltThroughTheSpringThatHoldsTheMaster) {
  for (const double k : {0.5, 2.0, 5.0}) {
    const Metrics metrics = run("two_channel", {"slave.hand.stiffness_nm_per_rad=" + number(k)});
    EXPECT_TRUE(metrics.is_true("stable"));
    EXPECT_NEAR(metrics.number("force_ratio"), 1.0, 0.005);
    EXPECT_NEAR(metrics.number("k_seen_ratio"), 1 / (1 + k / 5), 0.005);
  }
}

TEST(TorqueSessions, BehindAnMcuTooAndNothingJumps) {
  for (const char* scene : {"two_channel", "wave"}) {
    for (const char* device : {"DIRECT_DRIVE", "SERIES_ELASTIC"}) {
      const LoadedScene loaded = load_scene(
          scene, std::vector<std::string>{std::string("slave.device=") + device, "control.K_f_per_kgm2=125",
                                          "master.therapist.grip=FIRM", "slave.hand.stiffness_nm_per_rad=5"});
      const Session session = simulate(loaded);
      const Metrics metrics = compute_metrics(session, loaded.scene);
      EXPECT_TRUE(metrics.is_true("stable")) << scene << device;
      EXPECT_NEAR(metrics.number("force_ratio"), 1.0, 0.01) << scene << device;
      const double softer = scene == std::string("wave") ? 1 / 5.0 + 0.2 / (2 * 0.2) : 1 / 5.0;
      EXPECT_NEAR(metrics.number("k_seen_ratio"), 1 / (1 + 5 * softer), 0.005) << scene << device;
      for (const auto* rows : {&session.master, &session.slave}) {
        for (std::size_t k = 1; k < rows->size(); ++k) {
          const StationSample &before = (*rows)[k - 1], &now = (*rows)[k];
          if (before.state == now.state) continue;
          EXPECT_LE(std::abs(now.target_x_rad - before.target_x_rad), 1e-3) << now.t_s;
          EXPECT_LE(std::abs(now.command_nm - before.command_nm), 0.03) << now.t_s;
        }
      }
    }
  }
}

}  // namespace
}  // namespace farhand
