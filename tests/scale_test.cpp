// Sides of different size: 40 degrees of a prosthetic hand on 60 of an orthosis, and torques made smaller or larger.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "common/judge/metrics.hpp"
#include "netem/lab/simulation.hpp"

namespace farhand {
namespace {

struct Rest {
  double x_m, x_s, F_m, F_s;
  Metrics metrics;
};

Rest at_rest(const std::string& scene, double position, double force, const std::vector<std::string>& more) {
  std::vector<std::string> sets = {"control.position_scale=" + std::to_string(position),
                                   "control.force_scale=" + std::to_string(force), "slave.axis.range_min_rad=-0.5",
                                   "slave.axis.range_max_rad=0.5"};
  sets.insert(sets.end(), more.begin(), more.end());
  const LoadedScene loaded = load_scene(scene, sets);
  const Session session = simulate(loaded);
  const auto mean = [](const std::vector<StationSample>& rows, double StationSample::*field) {
    double sum = 0;
    for (std::size_t k = rows.size() - 1000; k < rows.size(); ++k) sum += rows[k].*field;
    return sum / 1000;
  };
  return {mean(session.master, &StationSample::true_x_rad), mean(session.slave, &StationSample::true_x_rad),
          -mean(session.master, &StationSample::true_f_nm), mean(session.slave, &StationSample::true_f_nm),
          compute_metrics(session, loaded.scene)};
}

// At rest x_s = p x_m, F_m = q F_s, and the arm and the hand balance: x_m = K_h A / (K_h + p q k).
TEST(Scale, AnglesAndTorquesOfBothSidesStandInTheirRatios) {
  constexpr double A = 0.3, K_h = 3.0, k = 2.0;
  for (const char* scene :
       {"zero_delay", "four_channel", "four_channel_cdob_sdcv", "four_channel_mediated", "four_channel_tank"}) {
    for (const double p : {1.5, 1.0, 2.0 / 3}) {
      for (const double q : {1.0, 0.5, 2.0}) {
        // The inertia of the force stays above that of the master: K_f / (p q) <= 1/J_n. And f_2 such that the SDCV
        // lets go.
        const Rest rest =
            at_rest(scene, p, q,
                    {"control.K_f_per_kgm2=" + std::to_string(std::min(1.0, p * q) * 250), "control.f_1_nm=0.05",
                     "control.f_2_nm=0.1", "master.therapist.grip=NORMAL", "slave.hand.stiffness_nm_per_rad=2"});
        const std::string cell = std::string(scene) + " " + std::to_string(p) + " " + std::to_string(q);
        const double x_m = K_h * A / (K_h + p * q * k);
        EXPECT_TRUE(rest.metrics.is_true("stable")) << cell;
        EXPECT_NEAR(rest.x_m, x_m, 0.02 * x_m) << cell;
        EXPECT_NEAR(rest.x_s / rest.x_m, p, 0.02 * p) << cell;
        EXPECT_NEAR(rest.F_m / rest.F_s, q, 0.02 * q) << cell;
        EXPECT_NEAR(rest.metrics.number("force_ratio"), 1.0, 0.02) << cell;
        EXPECT_NEAR(rest.metrics.number("k_seen_ratio"), 1.0, 0.02) << cell;
        if (std::string(scene).find("four_channel_cdob") == 0 || scene == std::string("zero_delay")) {
          EXPECT_LE(rest.metrics.number("tracking_rms_rad"), 5e-4 * std::max(1.0, p)) << cell;  // in the slave's size
        }
      }
    }
  }
}

TEST(Scale, AlsoBehindAnMcuAndWithTwoChannels) {
  const Rest elastic = at_rest("sea_four_channel_mediated", 1.5, 1.0, {});
  EXPECT_NEAR(elastic.x_s / elastic.x_m, 1.5, 0.03);
  EXPECT_NEAR(elastic.F_m / elastic.F_s, 1.0, 0.02);
  EXPECT_TRUE(elastic.metrics.is_true("stable"));
  // The spring K_2 between the sides: 1/k_seen = 1/k + 1/K_2 in the size of the master.
  const Rest two = at_rest("two_channel", 1.5, 0.8, {});
  EXPECT_NEAR(two.F_m / two.F_s, 0.8, 0.01);
  EXPECT_NEAR(two.metrics.number("k_seen_ratio"), 1 / (1 + 1.5 * 0.8 * 2.0 / 5.0), 0.01);
}

TEST(Scale, WavesHaveOneImpedanceOnBothSides) {
  try {
    load_scene("wave", std::vector<std::string>{"control.position_scale=1.5"});
    FAIL() << "a scaled wave was taken";
  } catch (const ConfigError& refused) {
    EXPECT_NE(std::string(refused.what()).find("must be 1 with architecture WAVE"), std::string::npos);
  }
}

}  // namespace
}  // namespace farhand
