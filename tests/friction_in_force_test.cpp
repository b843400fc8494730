// The friction of the patient's device as the results name it, and what the therapist is told when its tendons run
// harder than at the fitting. Virtual time.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <string>
#include <vector>

#include "common/config/load.hpp"
#include "common/judge/friction_source.hpp"
#include "common/judge/metrics.hpp"
#include "common/law/architectures.hpp"
#include "common/record/harder_tendons.hpp"
#include "netem/lab/simulation.hpp"

namespace farhand {
namespace {

Metrics metrics_of(const std::vector<std::string>& sets) {
  const LoadedScene scene = load_scene("zero_delay", sets);
  return compute_metrics(simulate(scene), scene.scene);
}

TEST(FrictionInForce, IsNamedByTheResultsOfARun) {
  const Metrics assumed = metrics_of({"windows={}", "duration_s=0.1"});
  EXPECT_EQ(assumed.number("friction_threshold_nm"), 0.1);
  EXPECT_EQ(assumed.text("friction_source"), "assumed: it was never measured");
  EXPECT_TRUE(std::isnan(assumed.number("friction_measured_nm")));
  const Metrics swept =
      metrics_of({"windows={}", "duration_s=42", "slave.hand={from_s: 1e6}", "slave.motor.coulomb_nm=0.05",
                  "operator_acts[0]={at_s: 0.5 act: SWEEP by: PATIENT}"});
  EXPECT_NEAR(swept.number("friction_measured_nm"), 0.05, 0.01);
  EXPECT_EQ(swept.number("friction_threshold_nm"), swept.number("friction_measured_nm"));
  EXPECT_LT(swept.number("friction_spread_nm"), 0.01);
  EXPECT_EQ(swept.text("friction_source"), "measured in this run");
}

TEST(FrictionInForce, SaysWhatItRestsOn) {
  DeviceFriction box{.threshold_nm = 0.06, .F_c_nm = 0.04, .spread_nm = 0.001, .swept_utc_s = 1'796'117'400};
  EXPECT_EQ(friction_source(box), "assumed from what was measured on 2026-12-01T09:30:00Z");
  box.measured = true;
  EXPECT_EQ(friction_source(box), "measured on 2026-12-01T09:30:00Z");
  box.swept_utc_s = std::numeric_limits<std::int64_t>::max();
  EXPECT_EQ(friction_source(box), "measured at no time");
}

TEST(FrictionInForce, OfARecordingFromBeforeIsAbsent) {
  const LoadedScene scene = load_scene("zero_delay", std::vector<std::string>{"windows={}", "duration_s=0.1"});
  Session session = simulate(scene);
  session.friction = {};
  const Metrics metrics = compute_metrics(session, scene.scene);
  EXPECT_TRUE(std::isnan(metrics.number("friction_threshold_nm")));
  EXPECT_EQ(metrics.at("friction_source").absent_because, "the box did not record it");
}

class Told final : public Witness {
 public:
  explicit Told(const scene::Scene& scene)
      : tendons_(names_of(architecture(scene::Architecture_Name(scene.architecture())).master.signals),
                 scene.control().force_scale()) {}
  void ticked(bool master, const Side& side, double t_s, OperatorAct /*act*/) override {
    if (!master) return;
    const std::string_view told = tendons_.step(side.trace(), side.receiver().newest());
    if (told.empty()) return;
    said.emplace_back(told);
    std::printf("%.3f s: %s\n", t_s, said.back().c_str());
  }
  std::vector<std::string> said;

 private:
  HarderTendons tendons_;
};

// What the therapist is told where a sweep has found F_c, and the tendons now have `friction`.
std::vector<std::string> told(const std::string& friction, const KnownFriction& known, const std::string& more) {
  const LoadedScene loaded = load_scene(
      "sea_four_channel_mediated",
      std::vector<std::string>{"slave.series_elastic.tendon_friction_nm=" + friction, "duration_s=26", more});
  const Sides sides = make_sides(loaded.scene);
  sides.slave->know(known);
  Told witness(loaded.scene);
  simulate(loaded, sides, witness);
  return witness.said;
}

TEST(HarderTendons, AreToldOnceAndOnlyAgainstASweep) {
  const std::string none = "seed=1";
  const auto harder = told("0.12", {.threshold = 0.03, .known = true}, none);
  ASSERT_EQ(harder.size(), 1u);
  EXPECT_TRUE(harder[0].starts_with("tendons run harder than at the fitting: friction 0.1")) << harder[0];
  EXPECT_TRUE(harder[0].ends_with("and 0.030 N m without the hand")) << harder[0];
  EXPECT_EQ(told("0.12", {.threshold = 0.03, .known = false}, none).size(), 0u) << "nothing to compare with";
  EXPECT_EQ(told("0.05", {.threshold = 0.05, .known = true}, none).size(), 0u) << "as at the fitting";
  EXPECT_EQ(told("0.12", {.threshold = 0.03, .known = true}, "architecture=FOUR_CHANNEL").size(), 0u)
      << "no such estimate";
}

}  // namespace
}  // namespace farhand
