// The axis identified by its own station, in virtual time.
#include <gtest/gtest.h>

#include <cstdio>
#include <string>

#include "common/config/load.hpp"
#include "common/runtime/side.hpp"
#include "tests/support/alloc_counter.hpp"
#include "tests/support/identified_session.hpp"

namespace farhand {
namespace {

using S = StationState;

bool said(const Session& session, const std::string& text) {
  for (const SessionEvent& event : session.events) {
    if (event.who == "slave" && event.text.find(text) != std::string::npos) return true;
  }
  return false;
}

TEST(Identifying, AFreeAxisThatIsThatOfTheSceneIsReadyAgainAfterwards) {
  const Session session = session_of(freed({"operator_acts[1]={at_s: 0.5 act: IDENTIFY}"}));
  EXPECT_TRUE(said(session, "identifying: operator"));
  EXPECT_TRUE(said(session, "ready: identified"));
  EXPECT_EQ(session.slave.back().state, static_cast<int>(S::kReady));
  EXPECT_EQ(session.master.back().state, static_cast<int>(S::kReady)) << "each by its own operator";
  double furthest = 0, fastest = 0, strongest = 0;
  for (const StationSample& row : session.slave) {
    furthest = std::max(furthest, std::abs(row.true_x_rad));
    fastest = std::max(fastest, std::abs(row.true_v_rad_s));
    strongest = std::max(strongest, std::abs(row.command_nm));
  }
  const scene::Axis axis = load_scene("zero_delay").scene.slave().axis();
  std::printf("at most %.3f rad, %.2f rad/s, %.3f N m\n", furthest, fastest, strongest);
  EXPECT_LE(furthest, 0.75 * axis.range_max_rad());
  EXPECT_LE(fastest, 1.25);
  EXPECT_LE(strongest, 0.5 + 1e-12);
  EXPECT_NEAR(session.slave.back().true_x_rad, session.slave.front().true_x_rad, 0.01);
}

TEST(Identifying, AnotherAxisIsAFaultThatSaysWhy) {
  const std::string bristle = "slave.motor.lugre={F_c_nm: 0.02 F_s_nm: 0.03 v_s_rad_s: 0.3 sigma_0_nm_per_rad: 1000}";
  const std::pair<std::vector<std::string>, const char*> wrong[] = {
      {{"slave.motor.J_kgm2=0.01"}, "inertia"},
      {{"slave.motor.coulomb_nm=0.2"}, "Coulomb friction"},
      {{"slave.motor.viscous_nms_per_rad=0.05"}, "viscous friction"},
      {{"slave.hand={stiffness_nm_per_rad: 0.5}"}, "a hand in the device?"},
      {{"slave.motor.coulomb_nm=0", bristle}, "backlash, another friction"}};
  for (const auto& [sets, why] : wrong) {
    const Session session = session_of(freed(sets));
    const std::string& set = sets.back();
    EXPECT_EQ(session.slave.back().state, static_cast<int>(S::kFault)) << set;
    EXPECT_TRUE(said(session, "fault: axis is not as the scene says")) << set;
    EXPECT_TRUE(said(session, why)) << set;
    EXPECT_EQ(session.slave.back().command_nm, 0.0);
  }
}

TEST(Identifying, WhatIsInTheWayEndsItSoon) {
  const Session session = session_of(freed({"slave.motor.stop_max_rad=0.1"}, 10));
  EXPECT_TRUE(said(session, "fault: blocked"));
}

TEST(Identifying, BeginsByItsActOnItsOwnSideOnlyAndEndsByAnyOther) {
  EXPECT_FALSE(
      said(session_of({"duration_s=3", "windows={}", "operator_acts[0]={at_s: 0.5 act: IDENTIFY by: PATIENT}"}),
           "identifying"))
      << "the scene must ask for it";
  const std::vector<std::string> therapist = {"operator_acts[0]={at_s: 0.5 act: IDENTIFY}"};
  EXPECT_FALSE(said(session_of(freed(therapist, 3)), "identifying")) << "the other side has no say";
  for (const auto& [act, end] : {std::pair{"HOLD", "fault: operator"},
                                 {"STOP", "stopped: operator"},
                                 {"IDENTIFY", "fault: operator"},
                                 {"RESET", "fault: operator"}}) {
    const Session session =
        session_of(freed({"operator_acts[1]={at_s: 3 act: " + std::string(act) + " by: PATIENT}"}, 5));
    EXPECT_TRUE(said(session, end)) << act;
    EXPECT_EQ(session.slave.back().command_nm, 0.0) << act;
  }
  const Session engaged = session_of(freed({"operator_acts[1]={at_s: 3 act: ENGAGE}"}, 20));
  EXPECT_EQ(engaged.slave.back().state, static_cast<int>(S::kIdentifying)) << "nobody engages meanwhile";
}

TEST(Identifying, ScenesThatCannotAreRefused) {
  const auto complaint = [](const char* scene, std::vector<std::string> sets) -> std::string {
    try {
      load_scene(scene, sets);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(complaint("demo", {"slave.axis.identification={}"}).find("needs a DIRECT_DRIVE"), std::string::npos);
  EXPECT_NE(complaint("zero_delay", {"slave.axis.identification={torque_nm: 0.02}"}).find("give at least 0.04 N m"),
            std::string::npos);
  EXPECT_NE(complaint("zero_delay", {"slave.axis.identification={}", "control.K_p_per_s2=0"}).find("above 0"),
            std::string::npos);
  EXPECT_NE(complaint("zero_delay", {"slave.axis.identification={rounds: 2}"}).find("from 3 to 50"), std::string::npos);
}

TEST(Identifying, ATickNeitherAllocatesNorLocks) {
  if (kCounterIsBlind) GTEST_SKIP() << "nothing can be counted below a sanitizer";
  const scene::Scene scene = load_scene("zero_delay", freed({"slave.axis.identification={rounds: 3}"})).scene;
  const std::unique_ptr<Side> side = make_simulated_slave(scene, 1);
  Nanoseconds now = 0;
  const auto tick = [&](OperatorAct act) {
    now += kMillisecond;
    side->tick(now, to_seconds(now), act, now % (7 * kSecond) == 0 ? 2 : 1);
  };
  for (int k = 0; k < 100; ++k) tick(OperatorAct::kNone);
  tick(OperatorAct::kIdentify);
  ASSERT_EQ(side->trace().state, S::kIdentifying);
  const TouchCounter counter;
  for (int k = 0; k < 60'000 && side->trace().state == S::kIdentifying; ++k) tick(OperatorAct::kNone);
  EXPECT_EQ(counter.since(), Touched{});
  EXPECT_EQ(side->trace().reason, Reason::kIdentified) << name_of(side->trace().misfit);
}

}  // namespace
}  // namespace farhand
