// Metrics on made-up sessions whose answers are known in closed form, in both directions of motion.
#include "common/judge/metrics.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <set>
#include <sstream>

#include "common/config/json.hpp"
#include "common/judge/alignment.hpp"
#include "common/judge/summary.hpp"
#include "common/link/packet.hpp"
#include "tests/support/made_up_session.hpp"

namespace farhand {
namespace {

class BothDirections : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Metrics, BothDirections, testing::Values(1.0, -1.0));

TEST_P(BothDirections, TrackingIsMeasuredAgainstTheDelayInForce) {
  const double sign = GetParam(), e = 0.003, T_p = kBase + kDepth;
  const auto x_m = [=](double t) { return sign * 0.25 * std::sin(kPi * t); };
  Session session = session_of(
      [=](double t) {
        return Instant{x_m(t), 0, 0, 0};
      },
      [=](double t) {
        return Instant{x_m(t - T_p) + sign * e, 0, 0, 0};
      });
  const Metrics metrics = compute_metrics(session, windows());
  EXPECT_NEAR(metrics.number("tracking_rms_rad"), e,
              1e-6);  // linear interpolation of the sine: 0.25 pi^2 dt^2 / 8 = 3e-7
  EXPECT_NEAR(metrics.number("tracking_peak_rad"), e, 1e-6);
  EXPECT_NEAR(metrics.number("tracking_run_rms_rad"), e, 1e-6);
  EXPECT_EQ(metrics.text("delay_source"), "link");

  // The depth of the buffer may change in mid-run: each tick counts with its own.
  for (StationSample& s : session.slave) {
    if (s.t_s < 4) continue;
    s.playout_delay_s = 0.05;
    s.true_x_rad = x_m(s.t_s - kBase - 0.05) + sign * e;
  }
  EXPECT_NEAR(compute_metrics(session, windows()).number("tracking_rms_rad"), e, 1e-6);
}

TEST_P(BothDirections, TrackingErrorOfASineHasItsClosedFormRms) {
  // Slave undelayed although 120 ms are in force: x(t) - x(t - T) = 2 A sin(w T / 2) cos(...), RMS A sqrt(2) sin(w T /
  // 2).
  const double sign = GetParam(), A = 0.25, T = kBase + kDepth;
  const Course sine = [=](double t) { return Instant{sign * A * std::sin(kPi * t), 0, 0, 0}; };
  const Metrics metrics = compute_metrics(session_of(sine, sine), windows());
  EXPECT_NEAR(metrics.number("tracking_rms_rad"), A * std::sqrt(2.0) * std::sin(kPi * T / 2), 1e-6);
  EXPECT_NEAR(metrics.number("tracking_peak_rad"), 2 * A * std::sin(kPi * T / 2), 1e-5);
}

TEST_P(BothDirections, DragIsTheDampingFeltInFreeMotion) {
  // Therapist's torque F = b v + k x: the spring is orthogonal to v over whole periods, the damping remains. true_f =
  // -F.
  const double sign = GetParam(), b = 0.004, k = 0.3, A = 0.25;
  const Course master = [=](double t) {
    const double x = sign * A * std::sin(kPi * t), v = sign * A * kPi * std::cos(kPi * t);
    return Instant{x, v, -(b * v + k * x), 0};
  };
  EXPECT_NEAR(compute_metrics(session_of(master, still(0, 0, 0)), windows()).number("drag_nms_per_rad"), b, 1e-9);
}

TEST_P(BothDirections, AForceThatNobodyExertsIsAPhantomAndInertiaIsNone) {
  // A device that feels like the inertia 1/K_f on a sine, with a bump of 0.2 N m at 5 s. The hand bears nothing.
  const double sign = GetParam(), A = 0.25, K_f = 250;
  scene::Scene scene = windows();
  scene.mutable_control()->set_k_f_per_kgm2(K_f);
  scene.mutable_master()->mutable_motor()->set_stop_min_rad(-0.349);
  scene.mutable_master()->mutable_motor()->set_stop_max_rad(0.349);
  const auto master = [&](double bump_nm) {
    return [=](double t) {
      const double x = sign * A * std::sin(kPi * t), v = sign * A * kPi * std::cos(kPi * t), F = -kPi * kPi * x / K_f;
      return Instant{x, v, -(F + (std::abs(t - 5) < 0.1 ? sign * bump_nm : 0)), 0};
    };
  };
  EXPECT_LE(compute_metrics(session_of(master(0), still(0, 0, 0)), scene).number("phantom_peak_nm"), 1e-4);
  Session session = session_of(master(0.2), still(0, 0, 0));
  EXPECT_NEAR(compute_metrics(session, scene).number("phantom_peak_nm"), 0.2, 1e-4);
  EXPECT_TRUE(std::isnan(compute_metrics(session, scene).number("phantom_late_peak_nm"))) << "shorter than a minute";
  // A hand that bears something at the time, or within a second and the round trip before, is felt with reason.
  for (StationSample& s : session.slave) {
    if (std::abs(s.t_s - 4.5) < 0.4) s.true_f_nm = sign * 0.03;
  }
  EXPECT_LE(compute_metrics(session, scene).number("phantom_peak_nm"), 1e-4);
}

TEST_P(BothDirections, ContactMetricsFollowFromSteadyTorquesAndAngles) {
  // F_m = 0.3, F_s = 0.6; master 0.2 rad past the rest angle, slave 0.25.
  const double sign = GetParam();
  Session session = session_of(still(0.05 + sign * 0.2, -sign * 0.3, -sign * 0.31),
                               still(0.05 + sign * 0.25, sign * 0.6, sign * 0.58));
  const Metrics metrics = compute_metrics(session, windows());
  EXPECT_NEAR(metrics.number("force_error_rms_nm"), 0.3, 1e-12);
  EXPECT_NEAR(metrics.number("force_error_peak_nm"), 0.3, 1e-12);
  EXPECT_NEAR(metrics.number("force_error_delayed_rms_nm"), 0.27, 1e-12);
  EXPECT_NEAR(metrics.number("force_ratio"), 0.5, 1e-12);
  EXPECT_NEAR(metrics.number("k_seen_ratio"), (0.3 / 0.2) / (0.6 / 0.25), 1e-12);
  EXPECT_EQ(metrics.text("force_source"), "true");
}

TEST_P(BothDirections, DelayedForceErrorComparesWithTheSlaveAsPlayedOut) {
  const double sign = GetParam(), T_p = kBase + kDepth;
  const auto f_s = [=](double t) { return sign * std::sin(kPi * t); };
  const Session session = session_of(
      [=](double t) {
        return Instant{0, 0, 0, -f_s(t - T_p) + 0.02};
      },
      [=](double t) {
        return Instant{0, 0, 0, f_s(t)};
      });
  EXPECT_NEAR(compute_metrics(session, windows()).number("force_error_delayed_rms_nm"), 0.02, 3e-6);
}

TEST_P(BothDirections, EnergyAtThePortsHasItsSign) {
  // Therapist pushes 0.4 N m over 0.2 rad and the slave presses 0.3 N m over 0.1 rad into the hand, then both come back
  // torque-free.
  const double sign = GetParam();
  const auto ramp = [=](double top, double t) { return sign * (t < 10 ? top * t / 10 : top * (20 - t) / 10); };
  const Session session = session_of(
      [=](double t) {
        return Instant{ramp(0.2, t), 0, t <= 10 ? -sign * 0.4 : 0, 0};
      },
      [=](double t) {
        return Instant{ramp(0.1, t), 0, t <= 10 ? sign * 0.3 : 0, 0};
      });
  const Metrics metrics = compute_metrics(session, windows());
  EXPECT_NEAR(metrics.number("energy_min_master_j"), 0.0, 1e-12);  // 0.08 J were taken from the therapist, none given
  EXPECT_NEAR(metrics.number("energy_min_slave_j"), -0.03, 1e-5);  // all delivered to the hand
  EXPECT_NEAR(metrics.number("energy_min_both_j"), 0.0, 1e-12);
}

TEST(Metrics, EnergyOfBothPortsShowsAnActiveTeleoperation) {
  const Course pushed_back = [](double t) {
    return Instant{0.01 * t, 0, 0.5, 0};
  };  // device drives therapist: F_m = -0.5
  const Metrics metrics = compute_metrics(session_of(pushed_back, still(0, 0, 0)), windows());
  EXPECT_NEAR(metrics.number("energy_min_both_j"), -0.1, 1e-9);
}

TEST(Metrics, NetworkFiguresAreThoseOfThePackets) {
  Session session = session_of(still(0, 0, 0), still(0, 0, 0));
  session.link.clear();
  for (int k = 0; k < 1000; ++k) session.link.push_back({k * kTick, true, k % 10 == 0, 0.05, 0.05 + 1e-5 * k});
  for (int k = 0; k < 1000; ++k) session.link.push_back({k * kTick, false, false, 0.02, k < 500 ? 0.02 : 0.024});
  session.master_counters.late = 30;
  session.slave_counters.late = 10;
  session.slave_counters.reordered = 100;
  const Metrics metrics = compute_metrics(session, windows());
  // 900 delivered forward, k not a multiple of 10: the 450th is k = 499, the 891st is k = 989 (nearest rank).
  EXPECT_NEAR(metrics.number("delay_forward_median_ms"), 50 + 4.99, 1e-9);
  EXPECT_NEAR(metrics.number("delay_forward_p99_ms"), 50 + 9.89, 1e-9);
  EXPECT_NEAR(metrics.number("delay_backward_median_ms"), 20, 1e-9);
  EXPECT_NEAR(metrics.number("delay_backward_p99_ms"), 24, 1e-9);
  EXPECT_NEAR(metrics.number("jitter_ms"), 10 / std::sqrt(12.0),
              0.01);  // the uniform forward one is the larger: 2.89 against 2
  EXPECT_NEAR(metrics.number("loss"), 0.05, 1e-12);
  EXPECT_NEAR(metrics.number("late"), 40.0 / 2040, 1e-12);
  EXPECT_NEAR(metrics.number("reordered"), 100.0 / 2040, 1e-12);
  EXPECT_NEAR(metrics.number("rtt_median_ms"), 200, 1e-9);
  EXPECT_NEAR(metrics.number("playout_median_ms"), 20, 1e-9);
}

TEST(Metrics, BaseDelayFollowsTheFastestPacketSoFar) {
  // The route becomes 40 ms faster at 4 s; what was played out before cannot have known.
  const auto x_m = [](double t) { return 0.25 * std::sin(kPi * t); };
  const auto T_p = [](double t) { return kDepth + (t < 4.06 ? 0.1 : 0.06); };
  Session session = session_of(
      [=](double t) {
        return Instant{x_m(t), 0, 0, 0};
      },
      [=](double t) {
        return Instant{x_m(t - T_p(t)), 0, 0, 0};
      });
  for (LinkSample& p : session.link) p.achieved_delay_s = p.t_s < 4 ? 0.1 : 0.06;
  EXPECT_LT(compute_metrics(session, windows()).number("tracking_peak_rad"), 1e-3);  // one tick at the change
}

TEST(Metrics, APacketIsShownAtATickAndNotBetweenTicks) {
  // 100.4 ms on the way are 101 ms from tick to tick, which is what the receiver counts its play-out from.
  const auto x_m = [](double t) { return 0.25 * std::sin(kPi * t); };
  Session session = session_of(
      [=](double t) {
        return Instant{x_m(t), 0, 0, 0};
      },
      [=](double t) {
        return Instant{x_m(t - 0.101 - kDepth), 0, 0, 0};
      });
  for (LinkSample& p : session.link) p.achieved_delay_s = 0.1004;
  EXPECT_LT(compute_metrics(session, windows()).number("tracking_peak_rad"), 1e-6);
}

TEST(Metrics, HalfTheRoundTripStandsInWithoutOneWayDelays) {
  const auto x_m = [](double t) { return 0.25 * std::sin(kPi * t); };
  Session session = session_of(
      [=](double t) {
        return Instant{x_m(t), 0, 0, 0};
      },
      [=](double t) {
        return Instant{x_m(t - 0.12), 0, 0, 0};
      });
  session.link.clear();
  const Metrics metrics = compute_metrics(session, windows());
  EXPECT_LT(metrics.number("tracking_rms_rad"), 1e-6);
  EXPECT_EQ(metrics.text("delay_source"), "half_rtt");
  EXPECT_TRUE(std::isnan(metrics.number("delay_forward_median_ms")));
  EXPECT_EQ(metrics.at("delay_forward_median_ms").absent_because, "no one-way delay was recorded");
}

TEST(Metrics, EstimatesStandInForTruthAndSaySo) {
  Session session = session_of(still(0.2, kNaN, -0.3), still(0.25, kNaN, 0.6));
  for (auto* samples : {&session.master, &session.slave}) {
    for (StationSample& s : *samples) s.true_x_rad = s.true_v_rad_s = kNaN;
  }
  const Metrics metrics = compute_metrics(session, windows());
  EXPECT_EQ(metrics.text("force_source"), "estimated");
  EXPECT_EQ(metrics.text("angle_source"), "estimated");
  EXPECT_NEAR(metrics.number("force_ratio"), 0.5, 1e-12);
}

Session ringing(double amplitude_now, double amplitude_before) {
  return session_of(still(0.2, -0.3, -0.3), [=](double t) {
    return Instant{0.2 + (t < 18 ? amplitude_before : amplitude_now) * std::sin(2 * kPi * t), 0, 0.3, 0.3};
  });
}

TEST(Metrics, StableMeansSmallOrClearlyShrinkingResidual) {
  Metrics metrics = compute_metrics(ringing(0.002, 0.002), windows());
  EXPECT_NEAR(metrics.number("residual_p2p_rad"), 0.004, 1e-9);
  EXPECT_TRUE(metrics.is_true("stable"));
  metrics = compute_metrics(ringing(0.01, 0.03), windows());
  EXPECT_NEAR(metrics.number("residual_p2p_rad"), 0.02, 1e-9);
  EXPECT_TRUE(metrics.is_true("stable"));
  metrics = compute_metrics(ringing(0.01, 0.015), windows());
  EXPECT_TRUE(metrics.is_false("stable"));
  EXPECT_EQ(metrics.text("verdict"), "failed");
  Session session = ringing(0, 0);
  session.slave[12000].state = static_cast<int>(StationState::kHolding);
  EXPECT_TRUE(compute_metrics(session, windows()).is_false("stable"));
}

// Where someone is meant to move the angle, that it moves says nothing about the loop.
TEST(Metrics, AnAngleThatSomeoneMovesIsNotJudged) {
  const Session session = ringing(0.01, 0.015);
  const auto judged = [&](const scene::Scene& scene) { return compute_metrics(session, scene).is_false("stable"); };
  const auto reason = [&](const scene::Scene& scene) {
    const Metrics metrics = compute_metrics(session, scene);
    EXPECT_TRUE(std::holds_alternative<std::monostate>(metrics.at("residual_p2p_rad").value));
    EXPECT_TRUE(std::holds_alternative<std::monostate>(metrics.at("stable").value));
    EXPECT_EQ(metrics.at("stable").absent_because, metrics.at("residual_p2p_rad").absent_because);
    EXPECT_EQ(metrics.text("verdict"), "ok");
    return metrics.at("stable").absent_because;
  };
  scene::Scene scene = windows();
  scene::Hand& hand = *scene.mutable_slave()->mutable_hand();
  hand.set_until_s(1e9);
  EXPECT_TRUE(judged(scene));
  hand.set_rest_amplitude_rad(0.15);
  EXPECT_EQ(reason(scene), "the patient moves by himself at the end of the contact window");
  hand.set_until_s(18);  // taken out before the last 2 s
  EXPECT_TRUE(judged(scene));
  hand.set_until_s(1e9), hand.set_rest_amplitude_rad(0), hand.set_tremor_nm(0.1);
  EXPECT_EQ(reason(scene), "the patient trembles at the end of the contact window");
  hand.set_tremor_nm(0);
  scene::Movement& sine = *scene.mutable_master()->mutable_therapist()->add_intended();
  sine.set_duration_s(18), sine.set_sine_amplitude_rad(0.3);
  EXPECT_TRUE(judged(scene));
  sine.set_duration_s(18.5);
  EXPECT_EQ(reason(scene), "the therapist swings to and fro at the end of the contact window");
}

TEST(Metrics, OnlyEngagedTicksCountForErrors) {
  Session session = session_of(still(0.2, -0.3, -0.3), still(0.2, 0.3, 0.3));
  for (auto* samples : {&session.master, &session.slave}) {
    for (StationSample& s : *samples) {
      if (s.t_s >= 5) continue;
      s.state = static_cast<int>(StationState::kReady);
      s.true_x_rad = -1e3;
    }
  }
  // The slave's first engaged tick plays out what the master sent 120 ms before, when it was not engaged: that does not
  // count either.
  const Metrics metrics = compute_metrics(session, windows());
  EXPECT_NEAR(metrics.number("tracking_run_peak_rad"), 0, 1e-12);
  EXPECT_NEAR(metrics.number("engaged_s"), 15, 1e-6);
  EXPECT_EQ(metrics.number("held_s"), 0);
}

TEST(Metrics, AbsentWindowsAreNullWithAReasonAndNeverZero) {
  scene::Scene scene;
  scene.set_duration_s(kDuration);
  const Session session = session_of(still(0.2, -0.3, -0.3), still(0.2, 0.3, 0.3));
  const Metrics metrics = compute_metrics(session, scene);
  const auto json = Json::parse(summary_json(metrics, true));
  for (const auto* key : {"tracking_rms_rad", "drag_nms_per_rad"}) {
    EXPECT_TRUE(json[key].is_null()) << key;
    EXPECT_EQ(metrics.at(key).absent_because, "the scene has no free window");
  }
  for (const auto* key : {"force_ratio", "k_seen_ratio", "stable", "residual_p2p_rad", "force_error_rms_nm"}) {
    EXPECT_TRUE(json[key].is_null()) << key;
    EXPECT_EQ(metrics.at(key).absent_because, "the scene has no contact window");
  }
  EXPECT_EQ(metrics.text("verdict"), "ok");
}

TEST(Metrics, AnEmptySessionIsFailedAndNothingIsZeroed) {
  const Metrics metrics = compute_metrics(Session{}, windows());
  EXPECT_EQ(metrics.text("verdict"), "failed");
  for (const auto* key : {"tracking_rms_rad", "force_ratio", "loss", "late", "rtt_median_ms", "torque_max_master_nm",
                          "energy_min_both_j"}) {
    EXPECT_TRUE(std::isnan(metrics.number(key))) << key;
    EXPECT_FALSE(metrics.at(key).absent_because.empty()) << key;
  }
}

TEST(Metrics, SurviveNaNInEveryField) {
  const Session good = session_of(still(0.2, -0.3, -0.3), still(0.25, 0.6, 0.6));
  using Field = double StationSample::*;
  for (const double bad : {kNaN, std::numeric_limits<double>::infinity()}) {
    for (const Field field : {&StationSample::t_s, &StationSample::x_rad, &StationSample::v_rad_s, &StationSample::f_nm,
                              &StationSample::command_nm, &StationSample::playout_delay_s, &StationSample::rtt_s,
                              &StationSample::true_x_rad, &StationSample::true_v_rad_s, &StationSample::true_f_nm}) {
      Session session = good;
      for (std::size_t k = 0; k < session.master.size(); k += 97) session.master[k].*field = bad;
      for (std::size_t k = 0; k < session.slave.size(); k += 89) session.slave[k].*field = bad;
      session.link[0].achieved_delay_s = bad;
      const Metrics metrics = compute_metrics(session, windows());
      EXPECT_NEAR(metrics.number("force_ratio"), 0.5, 1e-9);
      EXPECT_NEAR(metrics.number("tracking_rms_rad"), 0.05, 1e-9);
      EXPECT_EQ(metrics.text("verdict"), "degraded");  // 50 mrad
    }
  }
}

TEST(Metrics, PublishedListIsWhatIsWritten) {
  const Metrics metrics = compute_metrics(session_of(still(0.2, -0.3, -0.3), still(0.2, 0.3, 0.3)), windows());
  const auto all = Json::parse(summary_json(metrics, true)), deterministic = Json::parse(summary_json(metrics, false));
  std::vector<std::string> published, published_deterministic, written, written_deterministic;
  for (const MetricInfo& info : kMetrics) {
    published.emplace_back(info.key);
    if (info.deterministic) published_deterministic.emplace_back(info.key);
    EXPECT_FALSE(info.meaning.empty()) << info.key;
  }
  written = all.keys();
  written_deterministic = deterministic.keys();
  EXPECT_EQ(written, published);
  EXPECT_EQ(written_deterministic, published_deterministic);
  EXPECT_EQ(std::set<std::string>(published.begin(), published.end()).size(), published.size());
  for (const std::string& key : written) EXPECT_FALSE(all[key].is_object()) << key;
  for (const Metric& metric : metrics.all()) EXPECT_NE(metric.absent_because, "not computed") << metric.info->key;
}

TEST(Metrics, WallClockStaysOutOfTheDeterministicJson) {
  Session session = session_of(still(0.2, -0.3, -0.3), still(0.2, 0.3, 0.3));
  const std::string before = summary_json(compute_metrics(session, windows()), false);
  session.wall.real_time_factor = 42;
  session.master_counters.ticks = 1000;
  session.master_counters.overruns = 900;
  EXPECT_EQ(summary_json(compute_metrics(session, windows()), false), before);
  EXPECT_EQ(compute_metrics(session, windows()).number("real_time_factor"), 42);
}

TEST(Metrics, UnpublishedNamesAreRefused) {
  Metrics metrics;
  EXPECT_THROW(metrics.set("tracking", 1.0), std::out_of_range);
  EXPECT_THROW(metrics.number("tracking"), std::out_of_range);
}

TEST(Summary, RoundsToSixDigitsWithoutMinusZero) {
  Metrics metrics;
  metrics.set("force_ratio", 1.0 / 3.0);
  metrics.set("loss", -0.0);
  metrics.set("seed", std::uint64_t{9007199254740993});
  metrics.set("jitter_ms", std::numeric_limits<double>::infinity());
  const std::string json = summary_json(metrics, false);
  EXPECT_NE(json.find("\"force_ratio\": 0.333333,"), std::string::npos);
  EXPECT_NE(json.find("\"loss\": 0.0,"), std::string::npos);
  EXPECT_NE(json.find("\"seed\": 9007199254740993,"), std::string::npos);
  EXPECT_NE(json.find("\"jitter_ms\": null,"), std::string::npos);
}

TEST(Summary, CsvHasOneRowPerTickInOrderOfTimeAndEmptyFieldsForNaN) {
  Session session;
  session.master = side(still(0.5, kNaN, -0.25), 0, 0.002);
  session.slave = side(still(0.125, 1, 1), 0.001, 0.002);
  std::ostringstream out;
  write_csv(session, out);
  EXPECT_EQ(out.str(),
            "side,t_s,state,x_rad,v_rad_s,f_nm,remote_x_rad,remote_v_rad_s,remote_f_nm,target_x_rad,command_nm,x_cdob_"
            "rad,alpha,playout_delay_s,rtt_s,"
            "true_x_rad,true_v_rad_s,true_f_nm,limits\n"
            "master,0,2,0.5,0,-0.25,0,0,0,0,0,0,1,0.02,0.2,0.5,0,,0\n"
            "master,0.001,2,0.5,0,-0.25,0,0,0,0,0,0,1,0.02,0.2,0.5,0,,0\n"
            "slave,0.001,2,0.125,0,1,0,0,0,0,0,0,1,0.02,0.2,0.125,0,1,0\n"
            "master,0.002,2,0.5,0,-0.25,0,0,0,0,0,0,1,0.02,0.2,0.5,0,,0\n"
            "slave,0.002,2,0.125,0,1,0,0,0,0,0,0,1,0.02,0.2,0.125,0,1,0\n");
}

}  // namespace
}  // namespace farhand
