// What makes a session ok, degraded or failed.
#include "common/judge/verdict.hpp"

#include <gtest/gtest.h>

#include "common/judge/metrics.hpp"
#include "tests/support/made_up_session.hpp"

namespace farhand {
namespace {

Session good_session() { return session_of(still(0.2, -0.3, -0.3), still(0.2, 0.3, 0.3)); }

void set_state(std::vector<StationSample>& samples, double from, double until, StationState state) {
  for (StationSample& s : samples) {
    if (s.t_s >= from && s.t_s < until) s.state = static_cast<int>(state);
  }
}

std::string verdict(const Session& session, const scene::Scene& scene, std::string* why = nullptr) {
  const Metrics metrics = compute_metrics(session, scene);
  if (why != nullptr) {
    why->clear();
    for (const std::string& reason : metrics.list("reasons")) *why += reason + "\n";
  }
  return metrics.text("verdict");
}

TEST(Verdict, OkHasNoReasons) {
  std::string why;
  EXPECT_EQ(verdict(good_session(), windows(), &why), "ok");
  EXPECT_EQ(why, "");
}

TEST(Verdict, FaultAndMissingEngagementFail) {
  std::string why;
  Session session = good_session();
  set_state(session.slave, 8, 9, StationState::kFault);
  EXPECT_EQ(verdict(session, windows(), &why), "failed");
  EXPECT_NE(why.find("The slave went into fault at 8.00 s."), std::string::npos) << why;
  session = good_session();
  set_state(session.master, 0, 30, StationState::kReady);
  EXPECT_EQ(verdict(session, windows(), &why), "failed");
  EXPECT_NE(why.find("never engaged"), std::string::npos) << why;
}

// Also where the angle itself is not judged.
TEST(Verdict, LeavingEngagementInContactFailsAPatientWhoMoves) {
  std::string why;
  scene::Scene scene = windows();
  scene.mutable_slave()->mutable_hand()->set_tremor_nm(0.1);
  scene.mutable_slave()->mutable_hand()->set_until_s(1e9);
  Session session = good_session();
  EXPECT_EQ(verdict(session, scene, &why), "ok");
  set_state(session.slave, 12, 13, StationState::kHolding);
  EXPECT_EQ(verdict(session, scene, &why), "failed");
  EXPECT_NE(why.find("Contact was not stable: a side left engagement in it."), std::string::npos) << why;
}

TEST(Verdict, TendonsThatRunHarderThanAtTheFittingDegrade) {
  const auto judged = [](double identified, double F_c, bool measured, std::string* why) {
    Session session = good_session();
    session.master_signals = {"friction_nm"};
    session.friction = {.threshold_nm = F_c, .measured = measured, .F_c_nm = F_c, .spread_nm = 0.001};
    for (StationSample& row : session.master) row.law[0] = row.t_s > 5 && row.t_s < 6 ? identified : 0.0;
    return verdict(session, windows(), why);
  };
  std::string why;
  EXPECT_EQ(judged(0.09, 0.03, true, &why), "degraded");
  EXPECT_NE(why.find("The tendons run harder than at the fitting: friction of 0.0900 N m, and 0.0300 N m without the "
                     "hand."),
            std::string::npos)
      << why;
  EXPECT_EQ(judged(0.07, 0.03, true, &why), "ok") << why;
  EXPECT_EQ(judged(0.3, 0.03, false, &why), "ok") << "there is nothing to compare with: " << why;
}

TEST(Verdict, LimitsOfTheSceneDegrade) {
  std::string why;
  Session session = session_of(still(0.225, -0.3, -0.3), still(0.2, 0.3, 0.3));
  EXPECT_EQ(verdict(session, windows(), &why), "degraded");
  EXPECT_NE(why.find("RMS of 25.0 mrad, above the limit of 20.0 mrad"), std::string::npos) << why;
  session = good_session();
  session.slave_counters.late = 100;
  EXPECT_EQ(verdict(session, windows(), &why), "degraded");
  EXPECT_NE(why.find("4.76 %, above the limit of 2.00 %"), std::string::npos) << why;
}

TEST(Verdict, OverrunsDegradeOnlyWhatRanAgainstAClock) {
  Session session = good_session();
  session.slave_counters.ticks = 1000;
  session.slave_counters.overruns = 11;
  EXPECT_EQ(verdict(session, windows()), "ok");
  session.deterministic = false;
  EXPECT_EQ(verdict(session, windows()), "degraded");
  session.slave_counters.overruns = 10;
  EXPECT_EQ(verdict(session, windows()), "ok");
}

// 8 ms in every 60: what the controller did then is not its own doing.
TEST(Verdict, APcThatMissedItsTicksIsTheFirstReasonAndStabilityIsNotJudged) {
  std::string why;
  Session session = good_session();
  set_state(session.slave, 12, 13, StationState::kHolding);
  session.deterministic = false;
  session.slave_counters.ticks = 870;
  session.slave_counters.missed_ticks = 130;
  EXPECT_EQ(verdict(session, windows(), &why), "degraded");
  EXPECT_EQ(why.rfind("The PC of the slave missed 13.0 % of its ticks: nothing is said about the controller.", 0), 0u)
      << why;
  EXPECT_EQ(why.find("not stable"), std::string::npos) << why;
  EXPECT_EQ(compute_metrics(session, windows()).number("missed_ticks"), 0.13);
  set_state(session.slave, 14, 15, StationState::kFault);
  EXPECT_EQ(verdict(session, windows(), &why), "failed");
  EXPECT_EQ(why.rfind("The PC of the slave", 0), 0u) << why;
  session = good_session();
  session.slave_counters.ticks = 990;
  session.slave_counters.missed_ticks = 10;
  EXPECT_EQ(verdict(session, windows()), "ok");
}

// 11 ms move the angle for a second and are no failure; where stability failed they are said before it.
TEST(Verdict, AShortGapIsNamedBeforeContactThatWasNotStable) {
  for (const bool stable : {true, false}) {
    std::string why;
    Session session = good_session();
    session.deterministic = false;
    if (!stable) set_state(session.slave, 12, 13, StationState::kHolding);
    session.slave_counters.ticks = 20000;
    session.slave_counters.missed_ticks = 10;
    session.slave.erase(session.slave.begin() + 5000, session.slave.begin() + 5010);
    EXPECT_EQ(verdict(session, windows(), &why), stable ? "ok" : "failed");
    const bool named = why.rfind("The PC of the slave stood still for up to 11.0 ms: for a second after", 0) == 0;
    EXPECT_EQ(named, !stable) << why;
  }
}

TEST(Verdict, APcThatStoodStillOnceIsToldWithItsTime) {
  std::string why;
  Session session = good_session();
  session.deterministic = false;
  session.master_counters.ticks = 20000;
  session.master_counters.missed_ticks = 79;
  session.master.erase(session.master.begin() + 5000, session.master.begin() + 5079);
  EXPECT_EQ(verdict(session, windows(), &why), "degraded");
  EXPECT_EQ(why, "The PC of the master stood still for 80.0 ms: nothing is said about the controller.\n");
  EXPECT_NEAR(compute_metrics(session, windows()).number("longest_gap_ms"), 80, 1e-9);
  session.master_counters.record_overflow = 1;  // the gap may be the recording's
  EXPECT_EQ(verdict(session, windows()), "ok");
  session.slave_counters.record_overflow = 1;
  EXPECT_NE(compute_metrics(session, windows()).at("longest_gap_ms").absent_because, "");
}

TEST(Verdict, HoldingForWantOfThePeerDegrades) {
  std::string why;
  Session session = good_session();
  set_state(session.slave, 8, 8.5, StationState::kHolding);
  EXPECT_EQ(verdict(session, windows(), &why), "degraded");
  EXPECT_NE(why.find("held for 0.500 s"), std::string::npos) << why;
}

TEST(Verdict, HoldingOnRequestOrAtTheEndOfTheRunIsNoFlaw) {
  scene::Scene scene = windows();
  auto* act = scene.add_operator_acts();
  act->set_at_s(7.9);
  act->set_act(scene::HOLD);
  act = scene.add_operator_acts();
  act->set_at_s(8.4);
  act->set_act(scene::ENGAGE);
  Session session = good_session();
  set_state(session.slave, 8, 8.5, StationState::kHolding);
  EXPECT_EQ(verdict(session, scene), "ok");

  session = good_session();
  session.events = {{7.9, "master", "operator: hold"}, {8.4, "master", "operator: engage"}};
  set_state(session.slave, 8, 8.5, StationState::kHolding);
  EXPECT_EQ(verdict(session, windows()), "ok");

  // The slave started half a second after the master and waits for it at the end.
  session = good_session();
  session.slave = side(still(0.2, 0.3, 0.3), 0.5, kDuration + 0.5);
  set_state(session.slave, kDuration + 0.1, 30, StationState::kHolding);
  EXPECT_EQ(verdict(session, windows()), "ok");
}

TEST(Verdict, ARecordingThatEndsEarlyDegrades) {
  std::string why;
  Session session = good_session();
  session.master.resize(12000);
  set_state(session.slave, 12.1, 30, StationState::kHolding);
  EXPECT_EQ(verdict(session, windows(), &why), "degraded");
  EXPECT_NE(why.find("The recording of the master covers 12.0 s of 20.0 s."), std::string::npos) << why;
  EXPECT_NE(why.find("held"), std::string::npos) << why;
}

}  // namespace
}  // namespace farhand
