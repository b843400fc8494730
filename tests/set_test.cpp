// Settings on the command line: what --set changes, and what it says of those that are wrong.
#include <gtest/gtest.h>

#include <random>

#include "tests/support/complaint.hpp"

namespace farhand {
namespace {

TEST(Set, OverridesAndMends) {
  const scene::Scene scene = load_text(
      "duration_s: -1\noperator_acts { at_s: 1 act: ENGAGE }\nslave { hand { rest_rad: 0.1 } }",
      {"duration_s=5", "architecture=FOUR_CHANNEL", "slave.hand.stiffness_nm_per_rad=3.5", "operator_acts[0].at_s=1.5",
       "operator_acts={at_s: 2 act: HOLD}", "operator_acts[2].at_s=3", "operator_acts[2].act=STOP",
       "operator_acts[1]={ at_s: 2.5 act: HOLD }", "description=\"by hand\"", "seed=7"});
  EXPECT_EQ(scene.duration_s(), 5);
  EXPECT_EQ(scene.slave().hand().stiffness_nm_per_rad(), 3.5);
  EXPECT_EQ(scene.slave().hand().rest_rad(), 0.1);
  ASSERT_EQ(scene.operator_acts_size(), 3);
  EXPECT_EQ(scene.operator_acts(0).at_s(), 1.5);
  EXPECT_EQ(scene.operator_acts(1).at_s(), 2.5);
  EXPECT_EQ(scene.operator_acts(2).act(), scene::STOP);
  EXPECT_EQ(scene.seed(), 7u);
  EXPECT_EQ(load_text(kBase + "slave { hand { rest_rad: 0.1 } }", {"slave.hand={}"}).slave().hand().rest_rad(), 0)
      << "a group is replaced, not merged";
  const Sets none;
  EXPECT_EQ(load_scene_text(kBase, "FILE", none, 42).scene.seed(), 42u);
}

TEST(Set, SaysWhichArgumentIsWrong) {
  EXPECT_EQ(complaint(kBase, {"control.K_p_per_s=3"}),
            "--set control.K_p_per_s=3: there is no field 'K_p_per_s' in Control, did you mean 'K_p_per_s2'?");
  EXPECT_EQ(complaint(kBase, {"control.K_p_per_s2=-3"}),
            "--set control.K_p_per_s2=-3: control.K_p_per_s2 = -3 is not allowed; give a value from 0 to 1e6 1/s2 "
            "(position gain of C_p(s) = K_d s + K_p)");
  EXPECT_EQ(complaint(kBase, {"control.K_p_per_s2=abc"}), "--set control.K_p_per_s2=abc: Expected double, got: abc");
  EXPECT_EQ(complaint(kBase, {"control.K_p_per_s2=1 K_d_per_s: 2"}),
            "--set control.K_p_per_s2=1 K_d_per_s: 2: must give one value for one field");
  EXPECT_EQ(complaint(kBase, {"control.K_p_per_s2="}), "--set control.K_p_per_s2=: Expected double, got: the end");
  EXPECT_EQ(complaint(kBase, {"control.K_p_per_s2"}), "--set control.K_p_per_s2: must be field.path=value");
  EXPECT_EQ(complaint(kBase, {"architecture=FIVE"}),
            "--set architecture=FIVE: architecture cannot be 'FIVE'; give one of FOUR_CHANNEL, FOUR_CHANNEL_CDOB, "
            "FOUR_CHANNEL_CDOB_SDCV, MODEL_MEDIATED, TWO_CHANNEL, WAVE, "
            "FOUR_CHANNEL_TANK, AUTOMATIC, TWO_CHANNEL_PO_PC");
  EXPECT_EQ(complaint(kBase, {"duration_s.x=1"}), "--set duration_s.x=1: duration_s has no fields of its own");
  EXPECT_EQ(complaint(kBase, {"duration_s[0]=1"}), "--set duration_s[0]=1: duration_s is not a list");
  EXPECT_EQ(complaint(kBase, {"operator_acts[1].at_s=1"}),
            "--set operator_acts[1].at_s=1: operator_acts has 0 elements; the next one to add is [0]");
  EXPECT_EQ(complaint(kBase, {"operator_acts.at_s=1"}),
            "--set operator_acts.at_s=1: operator_acts is a list; say which element, such as operator_acts[0]");
  EXPECT_EQ(
      complaint(kBase, {"operator_acts[x].at_s=1"}),
      "--set operator_acts[x].at_s=1: 'operator_acts[x]' is not a field; an element of a list is written name[0]");
  EXPECT_EQ(complaint(kBase, {"operator_acts[0].at_s=1"}),
            "--set operator_acts[0].at_s=1: operator_acts[0].act is missing and has no default; give one of ENGAGE, "
            "HOLD, STOP, RESET, HOME, IDENTIFY, SWEEP (what is asked for)");
  EXPECT_EQ(complaint(kBase, {"slave.hand={stif: 3}"}),
            "--set slave.hand={stif: 3}: there is no field 'stif' in Hand, did you mean 'stiffness_nm_per_rad'?");
  EXPECT_EQ(complaint(kBase, {"slave.hand={from_s: 3}", "slave.hand.until_s=2"}),
            "--set slave.hand={from_s: 3}: slave.hand.from_s = 3 must be below until_s = 2");
  EXPECT_EQ(complaint(kBase, {"control.sdcv_from_patient=true"}),
            "--set control.sdcv_from_patient=true: control.sdcv_from_patient = true needs architecture "
            "FOUR_CHANNEL_CDOB_SDCV, and this one is FOUR_CHANNEL, which has no f_1 and f_2");
  EXPECT_EQ(complaint(kBase, {"control.sdcv_from_patient=true", "architecture=FOUR_CHANNEL_CDOB_SDCV"}), "");
  EXPECT_EQ(complaint(kBase, {"..=1", "=", "\xff=1"}),
            "--set ..=1: there is no field '' in Scene\n"
            "--set =: must be field.path=value\n"
            "--set: the argument is not UTF-8 text");
}

TEST(Set, SurvivesAnyArgument) {
  const std::vector<std::string> pieces = {"slave", "hand", ".", "=", "[0]", "[", "]",    "operator_acts", "{",
                                           "}",     "at_s", ":", "1", "-",   " ", "\xff", "[99999999999]", "duration_s",
                                           "\""};
  std::mt19937_64 random(2);
  for (int i = 0; i < 10'000; ++i) {
    Sets sets(1);
    for (auto count = random() % 8; count > 0; --count) sets[0] += pieces[random() % pieces.size()];
    try {
      load_text(kBase, sets);
    } catch (const ConfigError& error) {
      EXPECT_NE(std::string(error.what()).find("--set"), std::string::npos) << sets[0];
    }
  }
}

}  // namespace
}  // namespace farhand
