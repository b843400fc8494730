// Encoders with few counts: a slower velocity for the law, the same speed for the guards, and whole sessions.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "common/config/load.hpp"
#include "common/judge/metrics.hpp"
#include "common/signal/axis_speed.hpp"
#include "netem/lab/simulation.hpp"
#include "tests/support/contact_cell.hpp"

namespace farhand {
namespace {

double g_v(const std::string& scene, const std::vector<std::string>& sets) {
  return load_scene(scene, sets).scene.control().g_v_rad_s();
}

TEST(CoarseEncoders, SlowTheVelocityUnlessTheSceneNamesIt) {
  EXPECT_EQ(g_v("four_channel", {}), 500);
  for (const char* encoder : {"master.motor.encoder_counts_per_rev=", "slave.motor.encoder_counts_per_rev="}) {
    const std::string scene = "four_channel_mediated";
    EXPECT_EQ(g_v(scene, {encoder + std::string("4096")}), 200) << encoder;
    EXPECT_EQ(g_v(scene, {encoder + std::string("9999")}), 200) << encoder;
    EXPECT_EQ(g_v(scene, {encoder + std::string("10000")}), 500) << encoder;
    EXPECT_EQ(g_v(scene, {encoder + std::string("0")}), 500) << encoder << ", ideal";
    EXPECT_EQ(g_v(scene, {encoder + std::string("4096"), "control.g_v_rad_s=500"}), 500) << encoder;
    EXPECT_EQ(g_v("auto_detour", {encoder + std::string("4096")}), 200) << encoder;
    EXPECT_EQ(g_v("four_channel", {encoder + std::string("4096")}), 500) << encoder << ", a loop over the network";
  }
  EXPECT_EQ(g_v("sea_four_channel_mediated", {"slave.series_elastic.joint_counts_per_rev=4096"}), 200);
  EXPECT_EQ(g_v("sea_four_channel_mediated", {"slave.motor.encoder_counts_per_rev=4096"}), 500)
      << "no part of this device";
}

TEST(CoarseEncoders, GuardsSeeTheSpeedTheyAlwaysSaw) {
  constexpr double kTick = 1e-3;
  for (const double law : {50.0, 200.0, 500.0, 2000.0}) {
    AxisSpeed<1> speed(Cutoff::rad_s(law), kTick);
    Derivative<1> own(Cutoff::rad_s(law), kTick), guard(Cutoff::rad_s(std::max(law, 500.0)), kTick);
    EXPECT_EQ(speed.two(), law < 500.0);
    speed.reset(Joints<1>(0.3)), own.reset(Joints<1>(0.3)), guard.reset(Joints<1>(0.3));
    for (int k = 0; k < 2000; ++k) {
      const Joints<1> x(0.3 * std::cos(0.05 * k));
      if (k % 7 == 0) {
        speed.across(x, 3), own.across(x, 3), guard.across(x, 3);
      } else {
        speed.step(x), own.step(x), guard.step(x);
      }
      ASSERT_EQ(speed.value()[0], own.value()[0]) << law;
      ASSERT_EQ(speed.for_guards()[0], guard.value()[0]) << law;
      ASSERT_EQ(speed.last()[0], own.last()[0]) << law;
    }
  }
}

// The hardest of a session over jitter and loss with 4096 counts on both sides.
void at_4096_counts(const std::string& scene, const std::vector<double>& delays, int seeds, double tracking_mrad) {
  const bool elastic = scene.starts_with("sea");
  double rest = 0, tracking = 0;
  int cells = 0;
  each_contact_cell(delays, seeds, true, [&](const ContactCell& cell) {
    const LoadedScene loaded = load_scene(
        scene, cell, false,
        {"master.motor.encoder_counts_per_rev=4096",
         elastic ? "slave.series_elastic.joint_counts_per_rev=4096" : "slave.motor.encoder_counts_per_rev=4096"});
    const Metrics metrics = compute_metrics(simulate(loaded), loaded.scene);
    const double moved = 1e3 * metrics.number("residual_p2p_rad"), off = 1e3 * metrics.number("tracking_rms_rad");
    // A light hand moves slowly where nothing, or next to nothing, holds it.
    const bool may_stir = cell.grip == "LIGHT" && (cell.environment == "free" || cell.environment == "0.5");
    EXPECT_TRUE(metrics.is_true("stable") || may_stir) << cell.name();
    // Behind an MCU he also goes between two counts on a soft hand.
    const bool two_counts = elastic && cell.grip == "LIGHT" && cell.environment == "2";
    EXPECT_LE(moved, may_stir ? 10.0 : two_counts ? 3.5 : 2.0) << cell.name();
    EXPECT_LE(off, tracking_mrad) << cell.name();
    rest = std::max(rest, moved);
    tracking = std::max(tracking, off);
    ++cells;
  });
  std::printf("%s, %d sessions at 4096 counts: rest within %.2f mrad, tracking within %.2f mrad\n", scene.c_str(),
              cells, rest, tracking);
}

TEST(CoarseEncoders, EveryContactOver100MillisecondsIsStable) {
  at_4096_counts("four_channel_mediated", {0.1}, 1, 1.5);
}
TEST(NightlyCoarseEncoders, EveryContactIsStable) {
  at_4096_counts("four_channel_mediated", {0.02, 0.1, 0.3, 0.5}, 5, 1.5);
}
// Behind an MCU the slave tracks to 2.6 mrad whatever the encoder.
TEST(NightlyCoarseEncoders, EveryContactBehindAnMcuIsStable) {
  at_4096_counts("sea_four_channel_mediated", {0.02, 0.1, 0.3, 0.5}, 2, 2.6);
}

}  // namespace
}  // namespace farhand
