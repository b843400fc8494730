// f_1 and f_2 of SDCV as identified from the patient: which motions identify them, which must not, and what a session
// gains.
#include "common/law/patient_thresholds.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "common/judge/metrics.hpp"
#include "netem/lab/simulation.hpp"

namespace farhand {
namespace {

constexpr double kTick = 1e-3, kNoise = 0.024, kCount = 2 * 3.14159265358979 / 20000;
constexpr SdcvParams kScene{.f_1 = 0.35, .f_2 = 0.75};

// The slave is moved along x(t) and tells f(x, t) with the counts of its encoder and the noise of its observer.
void move(PatientThresholds& thresholds, double seconds, const std::function<double(double)>& x_of,
          const std::function<double(double x, double t)>& f_of, std::mt19937& dice) {
  std::normal_distribution<double> noise(0.0, kNoise);
  for (double t = 0; t < seconds; t += kTick) {
    const double x = x_of(t);
    thresholds.step(kCount * std::round(x / kCount), f_of(x, t) + noise(dice));
  }
}
double swing(double t) { return 0.25 * std::sin(3.14159265358979 * t); }
double ramp(double t) { return 0.3 * std::min(1.0, t); }

TEST(PatientThresholds, AreThoseOfTheHandPressedEitherWayOrBoth) {
  const std::vector<std::pair<std::function<double(double)>, double>> motions{
      {ramp, 0.3}, {[](double t) { return -ramp(t); }, 0.3}, {swing, 0.25}};
  for (const double k : {0.5, 1.0, 2.0, 5.0, 10.0}) {
    for (const auto& [x, x_max] : motions) {
      for (unsigned seed = 1; seed <= 10; ++seed) {
        std::mt19937 dice(seed);
        PatientThresholds thresholds(kScene, kTick);
        move(
            thresholds, 4.0, x, [k](double at, double) { return k * at; }, dice);
        const double f_2 = 0.3 * k * x_max;
        EXPECT_NEAR(thresholds.named() / f_2, 1.0, 0.1) << k;
        EXPECT_NEAR(thresholds.k() / k, 1.0, 0.1) << k;
        EXPECT_DOUBLE_EQ(thresholds.f_2(), thresholds.named()) << "in force by now";
        const double in_force = thresholds.f_2();
        EXPECT_DOUBLE_EQ(thresholds.f_1(), std::clamp(0.03, 0.25 * in_force, 0.9 * in_force)) << "without friction";
      }
    }
  }
}

TEST(PatientThresholds, AreTheScenesInFreeMotionAndWhereNoHandIsToldBy) {
  std::mt19937 dice(5);
  const std::vector<std::pair<std::string, std::function<double(double, double)>>> others{
      {"nothing", [](double, double) { return 0.0; }},
      {"what the observers leave of a moving axis",
       [](double, double t) { return 0.02 * std::cos(3.14159265358979 * t); }},
      {"a weight", [](double, double) { return 0.3; }},
      {"a patient who pushes slowly", [](double, double t) { return 0.3 * std::sin(5.0 * t); }},
      {"a patient who pushes as he likes", [](double, double t) { return 0.3 * std::sin(7.7 * t); }},
      {"a patient who trembles", [](double, double t) { return 0.3 * std::sin(31.0 * t); }},
      {"a patient who moves of himself", [](double x, double) { return -3.0 * x; }}};
  for (const auto& [name, f] : others) {
    PatientThresholds thresholds(kScene, kTick);
    move(thresholds, 20.0, swing, f, dice);
    EXPECT_EQ(thresholds.named(), 0.0) << name;
    EXPECT_EQ(thresholds.f_1(), kScene.f_1) << name;
    EXPECT_EQ(thresholds.f_2(), kScene.f_2) << name;
  }
}

TEST(PatientThresholds, ComeIntoForceWithoutAStepAndStayInOrder) {
  for (const SdcvParams& scene : {kScene, SdcvParams{.f_1 = 0.01, .f_2 = 0.02}}) {
    for (const double k : {0.5, 5.0}) {
      std::mt19937 dice(7);
      PatientThresholds thresholds(scene, kTick);
      double f_1 = scene.f_1, f_2 = scene.f_2;
      move(
          thresholds, 4.0, swing,
          [&](double x, double) {
            EXPECT_LE(std::abs(thresholds.f_1() - f_1), 0.5 * kTick + 1e-12);
            EXPECT_LE(std::abs(thresholds.f_2() - f_2), 0.5 * kTick + 1e-12);
            f_1 = thresholds.f_1(), f_2 = thresholds.f_2();
            EXPECT_LT(f_1, f_2);
            return k * x;
          },
          dice);
      EXPECT_NEAR(f_2, 0.3 * k * 0.25, 0.1 * 0.3 * k * 0.25);
    }
  }
}

// A hand that comes after free motion, one that grows stiffer, and one that lies elsewhere after a new start.
TEST(PatientThresholds, FollowThePatient) {
  std::mt19937 dice(9);
  PatientThresholds thresholds(kScene, kTick);
  const auto hand = [](double k, double rest) { return [=](double x, double) { return k * (x - rest); }; };
  move(thresholds, 6.0, swing, hand(0.0, 0.0), dice);
  move(thresholds, 6.0, swing, hand(1.0, 0.0), dice);
  EXPECT_NEAR(thresholds.f_2(), 0.3 * 1.0 * 0.25, 0.0075);
  move(thresholds, 6.0, swing, hand(3.0, 0.0), dice);
  EXPECT_NEAR(thresholds.f_2(), 0.3 * 3.0 * 0.25, 0.0225);
  move(
      thresholds, 60.0, [](double t) { return 0.25 + 1e-4 * std::sin(40 * t); }, hand(3.0, 0.0), dice);
  EXPECT_NEAR(thresholds.f_2(), 0.3 * 3.0 * 0.25, 0.0225) << "rest wears nothing out";
  thresholds.reset();
  EXPECT_NEAR(thresholds.f_2(), 0.3 * 3.0 * 0.25, 0.0225) << "in force until the next is known";
  move(thresholds, 6.0, swing, hand(1.0, -0.25), dice);
  EXPECT_NEAR(thresholds.f_2(), 0.3 * 1.0 * 0.5, 0.015);
}

TEST(PatientThresholds, FrictionOfTheDeviceIsF1AndNotTheHand) {
  for (const double F_c : {0.05, 0.1, 0.2}) {
    for (const double k : {0.0, 0.5, 2.0, 5.0}) {
      std::mt19937 dice(11);
      PatientThresholds thresholds(kScene, kTick);
      Hysteresis z;
      move(
          thresholds, 14.0, swing,
          [&](double x, double t) {
            z.step(x, 5e-3);
            return F_c * z.value() + (t < 6 ? 0.0 : k * x);
          },
          dice);
      const double f_2 = 0.3 * k * 0.25;
      if (k == 0.0) {
        EXPECT_EQ(thresholds.named(), 0.0) << F_c;
        continue;
      }
      EXPECT_NEAR(thresholds.f_2() / f_2, 1.0, 0.1) << F_c << " " << k;
      EXPECT_NEAR(thresholds.f_1(), std::clamp(std::max(0.03, F_c), 0.25 * f_2, 0.9 * f_2), 0.1 * F_c)
          << F_c << " " << k;
    }
  }
}

struct Ran {
  Metrics metrics;
  double deflection = 0;  // of the hand, rad: the largest, true
};
Ran ran(const char* scene, double k, const char* grip, const char* from_patient,
        const std::vector<std::string>& more = {}) {
  // f_1 and f_2 as a scene has them that says nothing of the patient.
  std::vector<std::string> sets{
      "control.f_1_nm=0.35", "control.f_2_nm=0.75", std::string("control.sdcv_from_patient=") + from_patient,
      "slave.hand.stiffness_nm_per_rad=" + std::to_string(k), std::string("master.therapist.grip=") + grip};
  sets.insert(sets.end(), more.begin(), more.end());
  const LoadedScene loaded = load_scene(scene, sets);
  const Session session = simulate(loaded);
  Ran out{compute_metrics(session, loaded.scene)};
  for (const StationSample& row : session.slave) {
    if (row.t_s >= loaded.scene.slave().hand().from_s())
      out.deflection = std::max(out.deflection, std::abs(row.true_x_rad));
  }
  return out;
}

void session_names_f_2(const char* scene) {
  for (const double k : {0.5, 2.0, 5.0}) {
    for (const char* grip : {"NORMAL", "FIRM"}) {
      const Ran with = ran(scene, k, grip, "true");
      const double f_2 = 0.3 * k * with.deflection, named = with.metrics.number("f_2_identified_nm");
      std::printf("%s, hand %.1f, %s: f_2 %.4f named %.4f, force ratio %.4f, residual %.2f mrad, tracking %.2f mrad\n",
                  scene, k, grip, f_2, named, with.metrics.number("force_ratio"),
                  1e3 * with.metrics.number("residual_p2p_rad"), 1e3 * with.metrics.number("tracking_rms_rad"));
      EXPECT_NEAR(named / f_2, 1.0, 0.1) << k << grip;
      EXPECT_NEAR(with.metrics.number("force_ratio"), 1.0, 0.02) << k << grip;
      EXPECT_TRUE(with.metrics.is_true("stable")) << k << grip;
    }
  }
}

TEST(PatientThresholds, OfASessionAreThePatientsAndTheForceIsFeltInFull) {
  session_names_f_2("four_channel_cdob_sdcv");
  const Ran without = ran("four_channel_cdob_sdcv", 0.5, "NORMAL", "false");
  EXPECT_NEAR(without.metrics.number("force_ratio"), 0.5, 0.02) << "what it is good for";
  EXPECT_TRUE(std::isnan(without.metrics.number("f_2_identified_nm")));
}

TEST(PatientThresholds, OfASessionBehindAnMcuAreThePatientsToo) { session_names_f_2("sea_four_channel_cdob_sdcv"); }

// The hand is let go and taken out: its f_2 stays, and the softest one leaves the least room for full compensation.
TEST(PatientThresholds, OfAHandThatWasTakenOutLeaveFreeMotionLight) {
  for (const auto& [k, drag] : {std::pair{0.5, 0.03}, std::pair{2.0, 0.006}, std::pair{5.0, 0.001}}) {
    const Ran with = ran(
        "four_channel_cdob_sdcv", k, "NORMAL", "true",
        {"duration_s=34", "slave.hand.until_s=20", "master.therapist.intended[4].duration_s=6",
         "master.therapist.intended[5]={duration_s: 1 ramp_to_rad: 0}", "master.therapist.intended[6]={duration_s: 3}",
         "master.therapist.intended[7]={duration_s: 10 sine_amplitude_rad: 0.25 sine_frequency_hz: 0.5}",
         "master.therapist.intended[8]={duration_s: 2}", "windows={}", "windows.free={from_s: 24 until_s: 31}"});
    const double deflection = 0.3 * 3.0 / (3.0 + k);  // at rest, of the normal grip
    EXPECT_NEAR(with.metrics.number("f_2_identified_nm") / (0.3 * k * deflection), 1.0, 0.1) << k;
    std::printf("after a hand of %.1f: drag %.4f N m s/rad, tracking %.2f mrad\n", k,
                with.metrics.number("drag_nms_per_rad"), 1e3 * with.metrics.number("tracking_rms_rad"));
    EXPECT_LE(std::abs(with.metrics.number("drag_nms_per_rad")), drag) << k;
  }
}

// A hand that moves of itself or stiffens with speed and a stiff wall name nothing: the session is the one without.
TEST(PatientThresholds, OfWhoIsNoSpringAreTheScenes) {
  for (const char* scene : {"patient_moving", "patient_spastic", "four_channel_wall"}) {
    std::vector<std::string> sets{"architecture=FOUR_CHANNEL_CDOB_SDCV"};
    const LoadedScene without = load_scene(scene, sets);
    sets.push_back("control.sdcv_from_patient=true");
    const LoadedScene with = load_scene(scene, sets);
    const Session named = simulate(with), fixed = simulate(without);
    EXPECT_EQ(compute_metrics(named, with.scene).number("f_2_identified_nm"), 0.0) << scene;
    EXPECT_EQ(named.slave.back().true_x_rad, fixed.slave.back().true_x_rad) << scene;
  }
}

// What is named is the patient's own, whatever the size of the therapist's side.
TEST(PatientThresholds, AreInTheSizeOfTheSlave) {
  for (const char* force_scale : {"0.5", "2"}) {
    const Ran scaled = ran("four_channel_cdob_sdcv", 2.0, "NORMAL", "true",
                           {"control.position_scale=1.5", std::string("control.force_scale=") + force_scale});
    EXPECT_NEAR(scaled.metrics.number("f_2_identified_nm") / (0.3 * 2.0 * scaled.deflection), 1.0, 0.1) << force_scale;
    EXPECT_NEAR(scaled.metrics.number("force_ratio"), 1.0, 0.02) << force_scale;
  }
}

TEST(PatientThresholds, OfAHandBehindTendonsWithFrictionAreStillTheHands) {
  for (const char* F_c : {"0.05", "0.1"}) {
    for (const double k : {2.0, 5.0}) {
      const Ran with = ran("sea_four_channel_cdob_sdcv", k, "FIRM", "true",
                           {std::string("slave.series_elastic.tendon_friction_nm=") + F_c});
      const double f_2 = 0.3 * k * with.deflection;
      std::printf("friction %s, hand %.1f: f_2 %.4f named %.4f\n", F_c, k, f_2,
                  with.metrics.number("f_2_identified_nm"));
      EXPECT_NEAR(with.metrics.number("f_2_identified_nm") / f_2, 1.0, 0.1) << F_c << " " << k;
      EXPECT_TRUE(with.metrics.is_true("stable")) << F_c << " " << k;
    }
  }
}

}  // namespace
}  // namespace farhand
