// Whole sessions with patients who are not just a spring, and with a therapist who gives way: what the scenes of the
// repository are for.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "common/judge/metrics.hpp"
#include "netem/lab/simulation.hpp"

namespace farhand {
namespace {

using Sets = std::vector<std::string>;

struct Ran {
  scene::Scene scene;
  Session session;
  Metrics metrics;
};

Ran ran(const std::string& name, const Sets& sets = {}) {
  const LoadedScene loaded = load_scene(name, sets);
  Ran out{loaded.scene, simulate(loaded), {}};
  out.metrics = compute_metrics(out.session, out.scene);
  return out;
}

// The most that the hand pressed back with, in the sign of `direction`, in the contact window.
double hardest(const Ran& run, double direction = 1) {
  double most = 0;
  for (const StationSample& s : run.session.slave) {
    if (s.t_s >= run.scene.windows().contact().from_s() && s.t_s < run.scene.windows().contact().until_s())
      most = std::max(most, direction * s.true_f_nm);
  }
  return most;
}

TEST(Patients, AllAreBorneAndNoneIsJudgedByMovingOnHisOwn) {
  for (const char* name :
       {"patient_spastic", "patient_moving", "patient_relaxing", "patient_trembling", "therapist_reaction"}) {
    const Ran run = ran(name);
    EXPECT_EQ(run.metrics.text("verdict"), "ok") << name;
    const bool rests = name == std::string("patient_relaxing") || name == std::string("therapist_reaction");
    EXPECT_EQ(run.metrics.is_true("stable"), rests) << name;
    EXPECT_FALSE(run.metrics.is_false("stable")) << name;
  }
}

// What moving the hand to and fro costs in the contact window, J.
double work_on_hand(const Ran& run) {
  double work = 0;
  for (const StationSample& s : run.session.slave) {
    if (s.t_s >= run.scene.windows().contact().from_s() && s.t_s < run.scene.windows().contact().until_s())
      work += s.true_f_nm * s.true_v_rad_s * run.scene.tick_s();
  }
  return work;
}

// 0.3 N m s/rad beyond 0.2 rad/s, on a hand that is swung at up to 0.94 rad/s: each stretch is work that does not come
// back.
TEST(Patients, ASpasticHandCostsWorkToStretch) {
  for (const char* device : {"slave.device=DIRECT_DRIVE", "slave.device=SERIES_ELASTIC"}) {
    const Sets sets{device, "control.K_f_per_kgm2=125"};
    Sets never = sets;
    never.push_back("slave.hand.spastic_nms_per_rad=0");
    const double spastic = work_on_hand(ran("patient_spastic", sets)),
                 plain = work_on_hand(ran("patient_spastic", never));
    EXPECT_GT(plain, 0.0) << device;
    EXPECT_GT(spastic, 1.5 * plain) << device;
  }
}

// Steadily held, the tone that is left is felt at the end.
TEST(Patients, WhenToneHasFallenTheTherapistFeelsTheRelaxedHand) {
  const Ran run = ran("patient_relaxing");
  const StationSample& m = run.session.master.back();
  const double k = 10.0 / 11.0 * 1.0;  // grip of 10 N m/rad in series with the relaxed 1
  EXPECT_NEAR(-m.true_f_nm, 0.3 * k, 0.01);
  EXPECT_NEAR(run.metrics.number("force_ratio"), 1, 0.01);
}

// Where he would press with 1 N m he presses with what he wants, and the hand is moved as far as that goes.
TEST(Patients, ATherapistWhoGivesWayPressesNoHarderThanHeWants) {
  const Ran run = ran("therapist_reaction");
  double least = 1e9, most = 0;
  for (const StationSample& s : run.session.master) {
    if (s.t_s < 10 || s.t_s >= 24) continue;
    least = std::min(least, -s.true_f_nm), most = std::max(most, -s.true_f_nm);
  }
  EXPECT_GT(least, 0.59);
  EXPECT_LT(most, 0.61);
  EXPECT_NEAR(run.session.slave.back().true_x_rad, 0, 2e-3);  // and comes back to where he wanted to end
  const Ran firm = ran("therapist_reaction", {"master.therapist.reaction.above_nm=3"});
  EXPECT_GT(hardest(firm), 0.99);
}

// The hard ones, over 100 ms each way: what the therapist feels of a hand that moves by itself; of one that catches,
// the torque on the hand against the one felt when that motion was made (at the same instant, the delay alone is
// 0.15 N m).
TEST(Patients, WhatTheyDoIsFelt) {
  for (const char* network : {"{delay_s: 0.1}", "{delay_s: 0.1 jitter_s: 0.05 loss: 0.1}"}) {
    const Sets sets{std::string("network.forward=") + network, std::string("network.backward=") + network};
    const Ran moving = ran("patient_moving", sets), spastic = ran("patient_spastic", sets);
    EXPECT_LE(moving.metrics.number("force_error_rms_nm"), 0.05) << network;
    EXPECT_LE(spastic.metrics.number("force_error_of_motion_rms_nm"), 0.06) << network;
    std::printf("%s: moving %.4f N m, spastic %.4f N m for the same motion, %.4f N m at the same instant\n", network,
                moving.metrics.number("force_error_rms_nm"), spastic.metrics.number("force_error_of_motion_rms_nm"),
                spastic.metrics.number("force_error_rms_nm"));
  }
}

// Tapping at 1 Hz on a wall or a hand, then resting off it, at its edge, in it.
TEST(Patients, TappingLeavesNothingBehind) {
  double most = 0;
  for (const char* device : {"DIRECT_DRIVE", "SERIES_ELASTIC"}) {
    for (const bool wall : {true, false}) {
      for (const char* to : {"0", "0.1", "0.2"}) {
        for (const char* network : {"{delay_s: 0.1}", "{delay_s: 0.1 jitter_s: 0.05 loss: 0.1}"}) {
          Sets sets{std::string("slave.device=") + device,
                    std::string("master.therapist.intended[3].ramp_to_rad=") + to,
                    std::string("network.forward=") + network, std::string("network.backward=") + network};
          if (device == std::string("SERIES_ELASTIC")) sets.push_back("control.K_f_per_kgm2=125");
          if (!wall) {
            sets.push_back("slave.wall.at_rad=0.5");
            sets.push_back("slave.hand={stiffness_nm_per_rad: 2 from_s: 1.5}");
          }
          const Ran run = ran("tapping", sets);
          EXPECT_LE(run.metrics.number("residual_p2p_rad"), 4e-3) << device << wall << to << network;
          most = std::max(most, run.metrics.number("residual_p2p_rad"));
        }
      }
    }
  }
  std::printf("tapping leaves %.2f mrad at most\n", 1e3 * most);
}

// The same patients under each architecture. Nothing is asked of the others: this is the comparison.
TEST(Patients, UnderEveryArchitecture) {
  std::printf("%-24s %10s %10s %10s %10s\n", "force error, N m", "moving", "spastic", "(motion)", "tapping");
  for (const char* architecture : {"FOUR_CHANNEL", "FOUR_CHANNEL_CDOB", "FOUR_CHANNEL_CDOB_SDCV", "WAVE",
                                   "FOUR_CHANNEL_TANK", "TWO_CHANNEL_PO_PC", "MODEL_MEDIATED"}) {
    const Sets sets{std::string("architecture=") + architecture};
    const Ran moving = ran("patient_moving", sets), spastic = ran("patient_spastic", sets),
              tapping = ran("tapping", sets);
    std::printf("%-24s %10.4f %10.4f %10.4f %10.4f\n", architecture, moving.metrics.number("force_error_rms_nm"),
                spastic.metrics.number("force_error_rms_nm"), spastic.metrics.number("force_error_of_motion_rms_nm"),
                tapping.metrics.number("force_error_rms_nm"));
    for (const Ran* run : {&moving, &spastic, &tapping}) {
      EXPECT_TRUE(std::isfinite(run->metrics.number("force_error_rms_nm"))) << architecture;
    }
  }
}

}  // namespace
}  // namespace farhand
