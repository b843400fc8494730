// How closely the patient's device follows in free motion over jitter and loss, with encoders of 20000 counts.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "common/judge/metrics.hpp"
#include "netem/lab/simulation.hpp"
#include "tests/support/contact_cell.hpp"

namespace farhand {
namespace {

// Over +-50 % of jitter and 10 % of loss each way.
void tracks_within(double most_mrad, const std::string& scene, int seeds) {
  for (const double delay_s : {0.02, 0.1, 0.3, 0.5}) {
    double worst = 0;
    for (const char* grip : {"LIGHT", "NORMAL", "FIRM"}) {
      for (int seed = 1; seed <= seeds; ++seed) {
        const ContactCell cell{delay_s, "free", grip, seed};
        const LoadedScene loaded = load_scene(scene, cell);
        const double rms = 1e3 * compute_metrics(simulate(loaded), loaded.scene).number("tracking_rms_rad");
        EXPECT_LE(rms, most_mrad) << scene << ", " << cell.name();
        worst = std::max(worst, rms);
      }
    }
    std::printf("%s, %g s each way: tracking within %.3f mrad\n", scene.c_str(), delay_s, worst);
  }
}

TEST(FreeTracking, IsWithin400MicroradiansOverJitterAndLoss) { tracks_within(0.4, "four_channel_mediated", 1); }
TEST(NightlyFreeTracking, IsWithin400MicroradiansOverJitterAndLoss) { tracks_within(0.4, "four_channel_mediated", 5); }
// Behind an MCU the references go through its serial line and its own loops, whatever the network.
TEST(NightlyFreeTracking, BehindAnMcuIsWithin2Milliradians) { tracks_within(2.05, "sea_four_channel_mediated", 5); }

}  // namespace
}  // namespace farhand
