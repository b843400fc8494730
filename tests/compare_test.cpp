// Sessions side by side: which are the same, by how much they differ, and what is refused.
#include "netem/lab/compare.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>

#include "common/config/json.hpp"
#include "common/record/session_file.hpp"
#include "common/show/format.hpp"
#include "netem/lab/compare_report.hpp"
#include "netem/lab/simulation.hpp"
#include "tests/support/scratch_directory.hpp"
#include "tests/support/well_formed.hpp"

namespace farhand {
namespace {

using Sets = std::vector<std::string>;

// Free motion and contact in 10 s.
const Sets kShort{"duration_s=10",
                  "master.therapist.intended[0].duration_s=1",
                  "master.therapist.intended[1].duration_s=2",
                  "master.therapist.intended[2].duration_s=1",
                  "slave.hand.from_s=3.5",
                  "windows.free.from_s=1.5",
                  "windows.free.until_s=3",
                  "windows.contact.from_s=6",
                  "windows.contact.until_s=10"};

Sets with(Sets sets, const Sets& more) {
  sets.insert(sets.end(), more.begin(), more.end());
  return sets;
}

// A directory as processes leave one. They are stood in for by a run in virtual time, so that what they differ by is
// what `change` did.
std::string record(const ScratchDirectory& scratch, const char* name, const std::string& scene, const Sets& sets,
                   const std::function<void(Session&)>& change = {}) {
  static std::map<std::pair<std::string, Sets>, Session> once;
  const auto key = std::pair(scene, sets);
  if (!once.contains(key)) once[key] = simulate(load_scene(scene, sets));
  Session session = once[key];
  session.deterministic = false;
  if (change) change(session);
  const std::filesystem::path directory = scratch / name;
  std::filesystem::create_directories(directory);
  for (const char* role : {"master.mcap", "slave.mcap", "netem.mcap"}) write_session_mcap(session, directory / role);
  return directory.string();
}

std::string refusal(const ComparisonAsked& asked) {
  try {
    compared_sessions(asked);
  } catch (const std::exception& error) {
    return error.what();
  }
  return "nothing";
}

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t n = 0;
  for (std::size_t k = text.find(part); k != std::string::npos; k = text.find(part, k + 1)) ++n;
  return n;
}

TEST(Compare, TellsByHowMuchTheSteadyRatioOfProcessesDiffersFromThatOfTheLab) {
  const ScratchDirectory scratch;
  const auto weaker = [](Session& session) {
    for (StationSample& sample : session.master) sample.true_f_nm *= 0.9;
  };
  const std::string mediated = record(scratch, "mediated", "four_channel_mediated", kShort, weaker);
  const std::string sdcv = record(scratch, "sdcv", "four_channel_cdob_sdcv", with(kShort, {"runtime.priority=20"}));
  const std::vector<ComparedSession> all =
      compared_sessions({{mediated, sdcv, "four_channel_mediated", "four_channel_cdob_sdcv"}, kShort, {}, false});
  ASSERT_EQ(all.size(), 4u);
  EXPECT_FALSE(all[0].in_lab || all[1].in_lab);
  EXPECT_TRUE(all[2].in_lab && all[3].in_lab);
  const double ratio = all[2].metrics.number("force_ratio");
  ASSERT_GT(ratio, 0.5);
  const std::vector<SteadyDifference> differences = steady_differences(all);
  ASSERT_EQ(differences.size(), 2u);
  EXPECT_EQ(differences[0].processes, 0u);
  EXPECT_EQ(differences[0].lab, 2u);
  EXPECT_NEAR(differences[0].force_ratio, -0.1 * ratio, 1e-9);
  EXPECT_EQ(differences[1].processes, 1u);
  EXPECT_EQ(differences[1].lab, 3u) << "how processes run on their machine is no difference";
  EXPECT_NEAR(differences[1].force_ratio, 0.0, 1e-9);

  const std::string html = comparison_html(all);
  EXPECT_TRUE(well_formed(html));
  EXPECT_EQ(count(html, ">therapist on device F_m<"), 4u) << "a picture of each";
  for (const char* part : {"MODEL_MEDIATED, processes", "MODEL_MEDIATED, lab", "FOUR_CHANNEL_CDOB_SDCV, processes"})
    EXPECT_NE(html.find(part), std::string::npos) << part;
  const Json json = Json::parse(comparison_json(all));
  ASSERT_EQ(json["sessions"].size(), 4u);
  EXPECT_EQ(json["sessions"][std::size_t{0}]["ran_in"], Json("processes"));
  EXPECT_EQ(json["sessions"][3]["architecture"], Json("FOUR_CHANNEL_CDOB_SDCV"));
  EXPECT_EQ(json["sessions"][2]["metrics"]["scene"], Json("four_channel_mediated"));
  EXPECT_EQ(json["differences"][std::size_t{0}]["force_ratio_difference"], Json(differences[0].force_ratio));
  EXPECT_NE(comparison_text(all).find("mediated: F_m/F_s of the processes less that of the lab"), std::string::npos);
}

TEST(Compare, RunsInTheLabWhatProcessesRecordedUnlessItIsThere) {
  const ScratchDirectory scratch;
  const std::string recorded = record(scratch, "recorded", "four_channel_mediated", kShort);
  const std::vector<ComparedSession> all = compared_sessions({{recorded + "/"}, {}, {}, true});
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[1].name, "recorded") << "after the directory, with or without a slash at its end";
  EXPECT_TRUE(all[1].in_lab);
  const std::vector<SteadyDifference> differences = steady_differences(all);
  ASSERT_EQ(differences.size(), 1u);
  EXPECT_NEAR(differences[0].force_ratio, 0.0, 1e-9);
  EXPECT_EQ(compared_sessions({{recorded, "four_channel_mediated"}, kShort, {}, true}).size(), 2u);
}

TEST(Compare, OtherSettingsAreNamedAndNotSubtracted) {
  const ScratchDirectory scratch;
  const std::string recorded = record(scratch, "recorded", "four_channel_mediated", kShort);
  const std::vector<ComparedSession> all = compared_sessions(
      {{recorded, "four_channel_mediated"}, with(kShort, {"network.forward.delay_s=0.08"}), 3, false});
  const std::vector<SteadyDifference> differences = steady_differences(all);
  ASSERT_EQ(differences.size(), 1u);
  EXPECT_TRUE(std::isnan(differences[0].force_ratio));
  EXPECT_NE(differences[0].absent_because.find("network.forward.delay_s: 0.08 -> 0.1"), std::string::npos)
      << differences[0].absent_because;
  EXPECT_NE(differences[0].absent_because.find("seed: 3 -> 1"), std::string::npos);
  EXPECT_TRUE(well_formed(comparison_html(all)));
  EXPECT_TRUE(Json::parse(comparison_json(all))["differences"][std::size_t{0}]["force_ratio_difference"].is_null());
}

TEST(Compare, WhatIsAbsentIsADashWithItsReason) {
  const ScratchDirectory scratch;
  const std::string half = record(scratch, "half", "four_channel_mediated", kShort);
  std::filesystem::remove(half + "/slave.mcap");
  std::filesystem::remove(half + "/netem.mcap");
  const std::vector<ComparedSession> all = compared_sessions({{half, "four_channel_mediated"}, kShort, {}, false});
  const Metric& ratio = all[0].metrics.at("force_ratio");
  ASSERT_FALSE(ratio.absent_because.empty());
  const std::string html = comparison_html(all);
  EXPECT_TRUE(well_formed(html));
  EXPECT_NE(html.find("<td class=\"n\" title=\"" + escaped(ratio.absent_because) + "\">-</td>"), std::string::npos);
  for (const char* nothing : {"nan", "inf\""}) EXPECT_EQ(html.find(nothing), std::string::npos) << nothing;
  EXPECT_EQ(steady_differences(all)[0].absent_because, ratio.absent_because);
}

TEST(Compare, ADirectoryWithoutATickIsNoSceneToRun) {
  const ScratchDirectory scratch;
  const std::string empty = record(scratch, "empty", "four_channel_mediated", kShort, [](Session& session) {
    session.master.clear(), session.slave.clear(), session.link.clear();
  });
  const std::vector<ComparedSession> all = compared_sessions({{empty}, {}, {}, false});
  ASSERT_EQ(all.size(), 1u);
  EXPECT_FALSE(all[0].in_lab);
  EXPECT_TRUE(all[0].curves.master.t_s.empty());
  EXPECT_TRUE(well_formed(comparison_html(all)));
}

TEST(Compare, RefusesWhatIsNoSessionBeforeItRunsAny) {
  const ScratchDirectory scratch;
  const std::string recorded = record(scratch, "a/one", "four_channel_mediated", kShort);
  const std::string again = record(scratch, "b/one", "four_channel_mediated", kShort);
  const std::string nothing = (scratch / "nothing").string(), empty = scratch.path().string();
  EXPECT_EQ(refusal({{nothing}, {}, {}, false}), nothing + ": there is no such directory");
  EXPECT_EQ(refusal({{empty}, {}, {}, false}), empty + " holds no readable recording of a master or a slave");
  EXPECT_EQ(refusal({{recorded + "/master.mcap"}, {}, {}, false}),
            recorded + "/master.mcap: not a directory; a session is the directory that holds its recordings");
  EXPECT_NE(refusal({{"four_chanel"}, {}, {}, false}).find("there is no scene 'four_chanel'"), std::string::npos);
  EXPECT_EQ(refusal({{recorded, again}, {}, {}, false}),
            "two sessions of processes are called one; each needs a name of its own");
  EXPECT_EQ(refusal({{"demo", "demo"}, {}, {}, false}),
            "two sessions of the lab are called demo; each needs a name of its own");
  EXPECT_EQ(refusal({{recorded}, {"duration_s=5"}, {}, false}),
            "--set and --seed change scenes, and only directories are given");
  EXPECT_NE(refusal({{"demo"}, {"duration_s=-1"}, {}, false}).find("duration_s"), std::string::npos);
}

// The hard patients under every architecture, in one report.
TEST(Compare, AScenesArchitecturesStandSideBySide) {
  ComparisonAsked asked;
  for (const char* architecture :
       {"FOUR_CHANNEL", "FOUR_CHANNEL_CDOB", "FOUR_CHANNEL_CDOB_SDCV", "WAVE", "FOUR_CHANNEL_TANK", "MODEL_MEDIATED"}) {
    asked.sessions.push_back(std::string("patient_spastic,architecture=") + architecture);
  }
  asked.sets = {"duration_s=12", "windows.contact.until_s=12"};
  const std::vector<ComparedSession> sessions = compared_sessions(asked);
  ASSERT_EQ(sessions.size(), 6u);
  EXPECT_EQ(sessions[3].name, "patient_spastic architecture=WAVE");
  EXPECT_EQ(sessions[3].loaded.scene.architecture(), scene::WAVE);
  for (const ComparedSession& session : sessions) {
    EXPECT_EQ(session.loaded.scene.duration_s(), 12);
    EXPECT_TRUE(std::isfinite(session.metrics.number("force_error_of_motion_rms_nm"))) << session.name;
  }
  EXPECT_GT(count(comparison_html(sessions), "patient_spastic architecture=WAVE"), 0u);
  asked.sessions = {"patient_spastic,architecture=NONE"};
  EXPECT_NE(refusal(asked).find("architecture"), std::string::npos);
  asked.sessions = {"patient_spastic,"};
  EXPECT_NE(refusal(asked), "nothing");
}

}  // namespace
}  // namespace farhand
