// The friction of the patient's device measured by its own station, in virtual time.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <string>

#include "common/config/load.hpp"
#include "netem/lab/simulation.hpp"
#include "tests/support/alloc_counter.hpp"

namespace farhand {
namespace {

using S = StationState;

constexpr double kDeg5 = 0.0873;
const char* const kDevices[] = {"zero_delay", "sea_four_channel_mediated"};

bool elastic(const std::string& scene) { return scene.starts_with("sea"); }

// The box is asked to sweep 0.5 s after the start. Nothing is in the device unless `more` says otherwise.
Session swept(const std::string& scene, std::vector<std::string> more, double duration_s = 42) {
  std::vector<std::string> sets = {"windows={}", "duration_s=" + std::to_string(duration_s), "slave.hand={from_s: 1e6}",
                                   "operator_acts[0]={at_s: 0.5 act: SWEEP by: PATIENT}"};
  sets.insert(sets.end(), more.begin(), more.end());
  return simulate(load_scene(scene, sets));
}

std::string friction_of(const std::string& scene, double F_c) {
  const char* field = elastic(scene) ? "slave.series_elastic.tendon_friction_nm=" : "slave.motor.coulomb_nm=";
  return field + std::to_string(F_c);
}

// J_n/J: the inertia of the device, where the station's belief stays.
std::string inertia_of(const std::string& scene, double share) {
  const double J = 0.004 / share;
  return (elastic(scene) ? "slave.series_elastic.J_joint_kgm2=" : "slave.motor.J_kgm2=") + std::to_string(J);
}

std::string last_said(const Session& session, const std::string& begin) {
  std::string last;
  for (const SessionEvent& event : session.events) {
    if (event.who == "slave" && event.text.starts_with(begin)) last = event.text;
  }
  return last;
}

struct Seen {
  double F_c = -1.0, spread = -1.0, slope = 0.0;
  double strongest = 0.0, commanded = 0.0, fastest = 0.0, mean_speed = 0.0, furthest = 0.0, over_s = 0.0;
};

// While it sweeps.
Seen seen_in(const Session& session) {
  Seen seen;
  const std::string text = last_said(session, "friction: ");
  std::sscanf(text.c_str(), "friction: %lf N m, spread %lf N m, slope %lf", &seen.F_c, &seen.spread, &seen.slope);
  double moving = 0.0;
  for (const StationSample& row : session.slave) {
    if (row.state != static_cast<int>(S::kSweeping)) continue;
    seen.strongest = std::max(seen.strongest, std::abs(row.true_f_nm));
    seen.commanded = std::max(seen.commanded, std::abs(row.command_nm));
    const double speed = std::abs(row.true_v_rad_s);
    seen.fastest = std::max(seen.fastest, speed);
    if (speed > 0.5 * kDeg5) seen.mean_speed += (speed - seen.mean_speed) / (moving += 1.0);
    seen.furthest = std::max(seen.furthest, std::abs(row.true_x_rad));
    seen.over_s = row.t_s;
  }
  EXPECT_GT(moving, 0.0) << "it never swept";
  return seen;
}

void expect_found(const std::string& scene, double F_c, double J_share, int seed, double& worst) {
  const Session session =
      swept(scene, {friction_of(scene, F_c), inertia_of(scene, J_share), "seed=" + std::to_string(seed)});
  const Seen seen = seen_in(session);
  const std::string where = scene + " F_c " + std::to_string(F_c) + " J_n/J " + std::to_string(J_share);
  EXPECT_EQ(last_said(session, "ready:"), "ready: friction measured") << where;
  EXPECT_NEAR(seen.F_c, F_c, std::max(0.01, 0.15 * F_c)) << where;
  EXPECT_NEAR(seen.mean_speed, kDeg5, 0.05 * kDeg5) << where;
  // When it turns, the observer still gives the friction of the other direction for some ms.
  EXPECT_LE(seen.fastest, 3 * kDeg5) << where;
  EXPECT_LE(seen.commanded, 0.5) << where;
  EXPECT_GE(seen.furthest, 0.31) << where << ": the whole range";
  worst = std::max(worst, std::abs(seen.F_c - F_c));
  std::printf("%-27s F_c %.2f J_n/J %.1f seed %d: %.4f spread %.4f slope %.3f, %.3f N m, %.3f rad/s, %.1f s\n",
              scene.c_str(), F_c, J_share, seed, seen.F_c, seen.spread, seen.slope, seen.strongest, seen.fastest,
              seen.over_s);
}

TEST(Sweeping, FindsTheFrictionOfBothDevices) {
  double worst = 0.0;
  for (const char* scene : kDevices) {
    for (const double F_c : {0.0, 0.05, 0.3}) expect_found(scene, F_c, 1.0, 1, worst);
  }
  std::printf("worst error %.4f N m\n", worst);
}

TEST(NightlySweeping, FindsTheFrictionWhateverItIsAndHoweverWrongTheInertia) {
  double worst = 0.0;
  for (const char* scene : kDevices) {
    for (const double F_c : {0.0, 0.02, 0.05, 0.1, 0.3}) {
      for (const double share : {0.8, 1.0, 1.2}) {
        for (int seed = 1; seed <= 5; ++seed) expect_found(scene, F_c, share, seed, worst);
      }
    }
  }
  std::printf("worst error %.4f N m\n", worst);
}

TEST(Sweeping, AHandInTheDeviceIsRefusedAndNeverPressedHard) {
  for (const char* scene : kDevices) {
    for (const double k : {0.5, 2.0, 5.0}) {
      const Session session =
          swept(scene, {"slave.hand={stiffness_nm_per_rad: " + std::to_string(k) + "}", friction_of(scene, 0.05)});
      const Seen seen = seen_in(session);
      std::printf("%-27s hand %.1f: %s, %.3f N m, until %.1f s\n", scene, k, last_said(session, "fault:").c_str(),
                  seen.strongest, seen.over_s);
      EXPECT_EQ(last_said(session, "fault:"), "fault: something resists: a hand in the device?") << scene << k;
      EXPECT_LE(seen.strongest, 0.5) << scene << k;
      EXPECT_EQ(session.slave.back().state, static_cast<int>(S::kFault));
    }
  }
}

TEST(Sweeping, WhatIsInTheWayEndsItSoon) {
  const Session direct = swept("zero_delay", {"slave.motor.stop_max_rad=0.1"}, 20);
  EXPECT_EQ(direct.slave.back().state, static_cast<int>(S::kFault));
  const Session behind_mcu = swept("sea_four_channel_mediated", {"slave.series_elastic.stop_max_rad=0.1"}, 20);
  EXPECT_EQ(behind_mcu.slave.back().state, static_cast<int>(S::kFault));
}

TEST(Sweeping, EndsByEveryActAndByNothingOfThePeer) {
  for (const char* scene : kDevices) {
    for (const auto& [act, end] : {std::pair{"HOLD", "fault: operator"},
                                   {"STOP", "stopped: operator"},
                                   {"SWEEP", "fault: operator"},
                                   {"RESET", "fault: operator"}}) {
      const Session session = swept(scene, {"operator_acts[1]={at_s: 3 act: " + std::string(act) + " by: PATIENT}"}, 4);
      EXPECT_EQ(last_said(session, end), end) << scene << act;
      if (!elastic(scene)) {  // an MCU is told to let go
        EXPECT_EQ(session.slave.back().command_nm, 0.0) << act;
      }
    }
    const Session engaged = swept(scene, {"operator_acts[1]={at_s: 3 act: ENGAGE}"}, 10);
    EXPECT_EQ(engaged.slave.back().state, static_cast<int>(S::kSweeping)) << "nobody engages meanwhile";
    const Session asked = swept(scene, {"operator_acts[0]={at_s: 0.5 act: SWEEP}"}, 3);
    EXPECT_EQ(last_said(asked, "sweeping"), "") << "the therapist has no say";
    EXPECT_EQ(asked.master.back().state, static_cast<int>(S::kReady)) << "and nothing to sweep";
  }
}

TEST(Sweeping, ATickNeitherAllocatesNorLocks) {
  if (kCounterIsBlind) GTEST_SKIP() << "nothing can be counted below a sanitizer";
  const scene::Scene scene = load_scene("zero_delay", std::vector<std::string>{"slave.hand={from_s: 1e6}"}).scene;
  const std::unique_ptr<Side> side = make_simulated_slave(scene, 1);
  EXPECT_EQ(side->trace().friction.threshold, 0.1);
  Nanoseconds now = 0;
  const auto tick = [&](OperatorAct act) {
    now += kMillisecond;
    return side->tick(now, to_seconds(now), act, now % (7 * kSecond) == 0 ? 2 : 1);
  };
  for (int k = 0; k < 100; ++k) EXPECT_FALSE(tick(OperatorAct::kNone).friction_known);
  tick(OperatorAct::kSweep);
  ASSERT_EQ(side->trace().state, S::kSweeping);
  const TouchCounter counter;
  for (int k = 0; k < 60'000 && side->trace().state == S::kSweeping; ++k) tick(OperatorAct::kNone);
  EXPECT_EQ(counter.since(), Touched{});
  EXPECT_EQ(side->trace().reason, Reason::kSwept);
  const Packet<1> told = tick(OperatorAct::kNone);
  EXPECT_TRUE(told.friction_known) << "at once";
  EXPECT_EQ(told.friction, side->trace().swept.F_c);
}

}  // namespace
}  // namespace farhand
