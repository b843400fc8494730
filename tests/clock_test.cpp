// Nobody synchronises clocks: when the clock of the peer started, and how fast it runs, changes nothing that a run is
// judged by. A long run with a peer whose clock started a million seconds elsewhere and runs 200 ppm fast or slow is
// compared with the same run with equal clocks: for two minutes, and every night for an hour, in which 200 ppm are 0.72
// s.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <sstream>

#include "common/judge/metrics.hpp"
#include "netem/lab/simulation.hpp"

namespace farhand {
namespace {

class ClockDrift {
 public:
  // Swings for nearly the whole of duration_s, then contact. jitter_s > 0: also 1 % of the packets are lost.
  ClockDrift(double duration_s, double jitter_s) : duration_s_(duration_s), jitter_s_(jitter_s) {}

  // Every number of the published list changes by at most 1 %, or by less than what the way of measuring it resolves.
  void expect_no_number_to_change() const {
    const Metrics equal = metrics(0, 0);
    for (const double skew_ppm : {200.0, -200.0}) {
      const Metrics foreign = metrics(1e6, skew_ppm);
      EXPECT_EQ(foreign.text("verdict"), equal.text("verdict"));
      EXPECT_EQ(foreign.is_true("stable"), equal.is_true("stable"));
      for (const MetricInfo& info : kMetrics) {
        const double a = equal.number(info.key), b = foreign.number(info.key);
        ASSERT_EQ(std::isfinite(a), std::isfinite(b)) << info.key;
        if (!std::isfinite(a)) continue;
        EXPECT_LE(std::abs(b - a), std::max(0.01 * std::abs(a), resolution(info.key)))
            << info.key << " at " << skew_ppm << " ppm: " << b << " instead of " << a;
      }
    }
  }

  // A million seconds alone change not one bit.
  void expect_an_offset_to_change_nothing() const {
    const Metrics equal = metrics(0, 0), foreign = metrics(1e6, 0);
    for (const MetricInfo& info : kMetrics) EXPECT_EQ(equal.at(info.key).value, foreign.at(info.key).value) << info.key;
  }

 private:
  static constexpr const char* kScene = "four_channel_cdob_sdcv";

  Metrics metrics(double offset_s, double skew_ppm) const {
    std::vector<std::string> sets;
    const auto set = [&](const std::string& field, auto value) {
      std::ostringstream out;
      out << field << '=' << value;
      sets.push_back(out.str());
    };
    set("duration_s", duration_s_);
    set("master.therapist.intended[1].duration_s", duration_s_ - 20);
    set("slave.hand.from_s", duration_s_ - 17);
    set("windows.free.until_s", duration_s_ - 18);
    // 4 s after the ramp: how the ramp dies away depends on the phase in which its one beginning met the ticks.
    set("windows.contact.from_s", duration_s_ - 11);
    set("windows.contact.until_s", duration_s_);
    set("network.peer_clock_offset_s", offset_s);
    set("network.peer_clock_skew_ppm", skew_ppm);
    for (const std::string way : {"network.forward.", "network.backward."}) {
      if (jitter_s_ <= 0) continue;
      set(way + "jitter_s", jitter_s_);
      set(way + "distribution", "UNIFORM");
      set(way + "loss", 0.01);
    }
    const LoadedScene loaded = load_scene(kScene, sets);
    return compute_metrics(simulate(loaded), loaded.scene);
  }

  // Equal clocks keep the ticks of the two sides in step. Unequal ones let them slide through each other, once in 5 s,
  // so that a packet waits up to one tick more or less for its turn; and an encoder meets the movement elsewhere
  // between two of its counts. What these two make of a number is no effect of the clock.
  double resolution(std::string_view key) const {
    constexpr double kTick = 1e-3, kCount = 2 * 3.14159265 / 20000;
    constexpr double kSwing = 0.25 * 2 * 3.14159265 * 0.5;  // rad/s, largest intended speed
    // A count through velocity filter (500 rad/s: a third of it per tick), K_d and J_n.
    constexpr double kTorqueOfACount = 4e-3 * 40 * kCount / kTick / 3;
    constexpr double kGrip = 3;       // N m/rad
    constexpr double kDrag = 0.5e-4;  // N m s/rad, 1 % of what counts as light
    const std::map<std::string_view, double> resolutions{
        // Compared with the master one play-out delay ago, known to a tick at either end.
        {"tracking_rms_rad", kSwing * kTick},
        {"tracking_run_rms_rad", kSwing * kTick},
        {"tracking_peak_rad", 2 * kSwing * kTick},
        {"tracking_run_peak_rad", 2 * kSwing * kTick},
        {"residual_p2p_rad", kCount},
        {"torque_max_master_nm", kTorqueOfACount},
        {"torque_max_slave_nm", kTorqueOfACount},
        {"force_error_peak_nm", kTorqueOfACount},
        {"phantom_peak_nm", kTorqueOfACount},
        {"phantom_late_peak_nm", kTorqueOfACount},
        {"force_error_rms_nm", kGrip * kCount},
        {"force_error_delayed_rms_nm", kGrip * kCount},
        {"force_error_of_motion_rms_nm", kGrip * kCount},
        {"drag_nms_per_rad", kDrag},
        // The same drag over all the swings.
        {"energy_min_master_j", kDrag * 0.5 * kSwing * kSwing * duration_s_},
        {"energy_min_both_j", kDrag * 0.5 * kSwing * kSwing * duration_s_},
        {"rtt_median_ms", 1e3 * kTick},
        {"playout_median_ms", 1e3 * kTick},
        {"jitter_ms", 1e-6},  // a constant delay has none; rounding remains
        // Play-out looks back over 4 s and so trails the clock by 0.4 ms on the mean: of jitter that reaches from -20
        // to +20 ms, that much more is late.
        {"late", 0.4 / 40},
    };
    const auto found = resolutions.find(key);
    return found == resolutions.end() ? 0.0 : found->second;
  }

  double duration_s_, jitter_s_;
};

TEST(Clock, WhenItStartedChangesNotOneBit) { ClockDrift(40, 0.02).expect_an_offset_to_change_nothing(); }

TEST(Clock, HowFastItRunsChangesNoNumber) { ClockDrift(120, 0).expect_no_number_to_change(); }

TEST(Clock, HowFastItRunsChangesNoNumberThroughABadNetwork) { ClockDrift(120, 0.02).expect_no_number_to_change(); }

TEST(NightlyClock, HowFastItRunsChangesNoNumberOverAnHour) { ClockDrift(3600, 0).expect_no_number_to_change(); }

TEST(NightlyClock, HowFastItRunsChangesNoNumberOverAnHourOfABadNetwork) {
  ClockDrift(3600, 0.02).expect_no_number_to_change();
}

}  // namespace
}  // namespace farhand
