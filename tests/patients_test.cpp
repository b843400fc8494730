// Whole sessions with patients who are not just a spring, and with a therapist who gives way: what the scenes of the
// repository are for.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "common/record/metrics.hpp"
#include "tests/lab/simulation.hpp"

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

// 0.3 N m s/rad beyond 0.2 rad/s, on a hand that is swung at up to 0.94 rad/s.
TEST(Patients, ASpasticHandPressesBackHarder) {
  for (const char* device : {"slave.device=DIRECT_DRIVE", "slave.device=SERIES_ELASTIC"}) {
    const Sets sets{device, "control.K_f_per_kgm2=125"};
    Sets never = sets;
    never.push_back("slave.hand.spastic_nms_per_rad=0");
    const Ran spastic = ran("patient_spastic", sets), plain = ran("patient_spastic", never);
    EXPECT_GT(hardest(spastic), hardest(plain) + 0.05) << device;
    EXPECT_GT(hardest(spastic, -1), hardest(plain, -1) + 0.05) << device;
    EXPECT_LT(hardest(spastic), hardest(plain) + 0.3) << device;
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

}  // namespace
}  // namespace farhand
