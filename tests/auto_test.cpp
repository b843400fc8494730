// AUTOMATIC: which architecture suits the network, and changes between architectures that nobody feels.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "common/judge/metrics.hpp"
#include "common/law/chooser.hpp"
#include "netem/lab/simulation.hpp"

namespace farhand {
namespace {

constexpr double kTick = 1e-3;

Choice after(Chooser& chooser, double round_trip, double loss, double seconds) {
  for (double t = 0; t < seconds; t += kTick) chooser.step({round_trip, loss}, 1);
  return chooser.chosen().choice;
}

TEST(Chooser, TakesPlainFourChannelsNearbyAndTheMediatorElsewhere) {
  Chooser chooser(kTick);
  EXPECT_EQ(after(chooser, 0.0, 0.0, 1.0), Choice::kNone) << "before anything is known";
  EXPECT_EQ(after(chooser, 2e-3, 0.0, 5.0), Choice::kFourChannel);
  EXPECT_EQ(chooser.share(), 0.0);
  EXPECT_EQ(after(chooser, 5e-3, 0.0, 10.0), Choice::kFourChannel) << "within the hysteresis";
  EXPECT_EQ(after(chooser, 0.2, 0.0, 5.0), Choice::kMediated);
  EXPECT_EQ(chooser.share(), 1.0);
  EXPECT_EQ(after(chooser, 5e-3, 0.0, 60.0), Choice::kMediated);
  EXPECT_EQ(after(chooser, 2e-3, 0.0, 60.0), Choice::kFourChannel);
  EXPECT_EQ(after(chooser, 2e-3, 0.1, 5.0), Choice::kMediated) << "loss";
}

TEST(Chooser, NeitherAShareNorAGainJumps) {
  Chooser chooser(kTick);
  double share = 0, settle = chooser.settle();
  int changes = 0;
  Choice before = Choice::kNone;
  for (int k = 0; k < 200'000; ++k) {
    const bool far = (k / 23'000) % 2 == 1;
    chooser.step({far ? 0.6 : 2e-3, 0.0}, 1);
    if (k > 0) {
      EXPECT_LE(std::abs(chooser.share() - share), 2e-3);
    }
    share = chooser.share();
    settle = chooser.settle();
    EXPECT_GE(settle, 8.0);
    EXPECT_LE(settle, 20.0);
    changes += chooser.chosen().choice != before ? 1 : 0;
    before = chooser.chosen().choice;
  }
  EXPECT_GT(changes, 2);
  EXPECT_LT(changes, 200'000 * kTick / 2.0) << "no more often than its dwell lets it";
}

TEST(Auto, ADetourInContactIsNotFelt) {
  double step = 0, rest = 0;
  for (const double near_s : {0.001, 0.02}) {
    for (const char* device : {"DIRECT_DRIVE", "SERIES_ELASTIC"}) {
      for (const char* grip : {"NORMAL", "FIRM"}) {
        for (const char* k : {"0.5", "2", "5"}) {
          const std::string path = "{delay_s: " + std::to_string(near_s) +
                                   " distribution: CONSTANT detour_delay_s: 0.3 detour_from_s: 12 detour_until_s: 22}";
          std::vector<std::string> sets{
              "network.forward=" + path, "network.backward=" + path, std::string("slave.device=") + device,
              std::string("master.therapist.grip=") + grip, std::string("slave.hand.stiffness_nm_per_rad=") + k};
          if (device == std::string("SERIES_ELASTIC")) sets.push_back("control.K_f_per_kgm2=125");
          const LoadedScene loaded = load_scene("auto_detour", sets);
          const Session session = simulate(loaded);
          const Metrics metrics = compute_metrics(session, loaded.scene);
          const std::string cell = std::to_string(near_s) + device + grip + k;
          EXPECT_TRUE(metrics.is_true("stable")) << cell;
          EXPECT_EQ(metrics.number("held_s"), 0.0) << cell;
          EXPECT_NEAR(metrics.number("force_ratio"), 1.0, 0.02) << cell;
          int choices = 0;
          for (const SessionEvent& event : session.events) choices += event.text.starts_with("auto: ") ? 1 : 0;
          EXPECT_EQ(choices, near_s < 0.01 ? 3 : 1) << cell;
          for (std::size_t i = 11'500; i < session.master.size(); ++i) {
            const double moved = std::abs(session.master[i].target_x_rad - session.master[i - 1].target_x_rad);
            ASSERT_LE(moved, 1e-3) << cell << " at " << session.master[i].t_s;
            step = std::max(step, moved);
          }
          rest = std::max(rest, metrics.number("residual_p2p_rad"));
        }
      }
    }
  }
  std::printf("the motion to follow steps by at most %.3f mrad, rest within %.2f mrad\n", 1e3 * step, 1e3 * rest);
}

}  // namespace
}  // namespace farhand
