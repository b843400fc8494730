// The encoder of a direct drive freezes at any moment of a free motion: how soon the guard knows, and what the hand is
// put through until the torque is off.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>

#include "common/config/load.hpp"
#include "netem/lab/fault_rig.hpp"

namespace farhand {
namespace {

constexpr const char* kScene = R"(
architecture: FOUR_CHANNEL_CDOB
duration_s: 100
master { therapist { grip: FIRM intended { duration_s: 2.5 }
  intended { duration_s: 1000 sine_amplitude_rad: 0.25 sine_frequency_hz: 0.5 } } }
slave { motor { stop_min_rad: -0.5236 stop_max_rad: 0.5236 } }
network { forward { delay_s: 0.03 distribution: CONSTANT } backward { delay_s: 0.03 distribution: CONSTANT } }
)";

struct Harm {
  double speed = 0;             // rad/s, when it froze
  double noticed_ms = NAN;      // until no torque was left
  double way = 0, fastest = 0;  // of the hand until then
  double torque = 0;
  Reason reason = Reason::kNone;
};

// seconds: after the sine is under way.
Harm freeze(double seconds, const char* counts) {
  const std::vector<std::string> sets{std::string("slave.motor.encoder_counts_per_rev=") + counts};
  FaultRig rig(load_scene_text(kScene, "frozen.txtpb", sets).scene);
  const auto run_to = [&](double t_s) {
    while (to_seconds(rig.now) < t_s) rig.tick();
  };
  run_to(0.3);
  rig.act = OperatorAct::kEngage;
  run_to(5 + seconds);
  EXPECT_EQ(rig.slave.side->trace().state, StationState::kEngaged);
  Harm harm;
  harm.speed = std::abs(rig.velocity());
  const double from = rig.slave.side->truth().x;
  rig.slave_reading = [shown = std::numeric_limits<double>::quiet_NaN()](double x) mutable {
    return shown = std::isnan(shown) ? x : shown;
  };
  for (int ms = 0; ms < 2000 && std::isnan(harm.noticed_ms); ++ms) {
    rig.tick();
    harm.way = std::max(harm.way, std::abs(rig.slave.side->truth().x - from));
    harm.fastest = std::max(harm.fastest, std::abs(rig.velocity()));
    harm.torque = std::max(harm.torque, rig.torque());
    if (rig.slave.side->trace().state != StationState::kEngaged) harm.noticed_ms = ms;
  }
  harm.reason = rig.slave.side->trace().reason;
  return harm;
}

// Half a period of the sine. What is quick depends on the speed and on the counts (common/observer/plausibility.hpp);
// the rest is found by the torque that moves nothing, which is what the figures of SAFETY.md are from.
TEST(FrozenEncoder, IsKnownWithinMillisecondsInMotionAndElseByTheTorqueThatMovesNothing) {
  for (const char* counts : {"65536", "20000", "4096"}) {
    double way = 0, noticed_ms = 0;
    for (int k = 0; k < 10; ++k) {
      const Harm h = freeze(0.1 * k, counts);
      std::printf("%5s counts, at %.2f rad/s: after %4.0f ms; hand goes %5.1f mrad, up to %.2f rad/s and %.2f N m\n",
                  counts, h.speed, h.noticed_ms, 1e3 * h.way, h.fastest, h.torque);
      EXPECT_EQ(h.reason, Reason::kEncoderFrozen);
      if (h.speed > 0.7 && counts[0] != '4') {
        EXPECT_LE(h.noticed_ms, 5);
        EXPECT_LE(h.way, 5e-3);
      }
      way = std::max(way, 1e3 * h.way);
      noticed_ms = std::max(noticed_ms, h.noticed_ms);
      EXPECT_LE(h.torque, 0.5);
    }
    std::printf("%s counts: at most %.0f ms and %.0f mrad\n", counts, noticed_ms, way);
    EXPECT_LE(noticed_ms, 700);
  }
}

}  // namespace
}  // namespace farhand
