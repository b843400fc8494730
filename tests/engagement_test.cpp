// The state machine: nothing moves at start, engaging needs an act, and the table in STATES.md is the one in the code.
#include "common/station/engagement.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>
#include <string>

namespace farhand {
namespace {

using S = StationState;

EngagementInputs peer(S state, OperatorAct act = OperatorAct::kNone, bool aligned = false) {
  EngagementInputs in;
  in.peer_alive = true;
  in.peer = state;
  in.act = act;
  in.aligned = aligned;
  return in;
}

// A machine whose device has passed its test.
Engagement started(Role role, EngagementParams params = {}) {
  params.self_test = 0;
  Engagement machine(role, params);
  machine.step(-2, {});
  machine.step(-1, {});
  return machine;
}

EngagementInputs act(OperatorAct one) {
  EngagementInputs in;
  in.act = one;
  return in;
}

TEST(Engagement, LeaderAlignsOnlyByAnAct) {
  Engagement leader = started(Role::kLeader);
  for (int k = 0; k < 100; ++k) EXPECT_EQ(leader.step(k, peer(S::kReady, OperatorAct::kNone, true)), S::kReady);
  EXPECT_EQ(leader.step(100, peer(S::kReady, OperatorAct::kEngage)), S::kAligning);
  EXPECT_EQ(leader.step(101, peer(S::kReady)), S::kAligning);
  EXPECT_EQ(leader.step(102, peer(S::kReady, OperatorAct::kNone, true)), S::kEngaged);
}

TEST(Engagement, LeaderIgnoresTheActWithoutALivePeer) {
  Engagement leader = started(Role::kLeader);
  EngagementInputs in;
  in.act = OperatorAct::kEngage;
  EXPECT_EQ(leader.step(1, in), S::kReady);
  EXPECT_EQ(leader.step(2, peer(S::kFault, OperatorAct::kEngage)), S::kReady);
}

TEST(Engagement, LeaderGivesUpAligningAndWaitingAfterTheTimeout) {
  Engagement leader = started(Role::kLeader, {.timeout = 1000});
  leader.step(0, peer(S::kReady, OperatorAct::kEngage));
  EXPECT_EQ(leader.step(1000, peer(S::kReady)), S::kAligning);
  EXPECT_EQ(leader.step(1001, peer(S::kReady)), S::kHolding);
  leader.step(1002, peer(S::kReady, OperatorAct::kEngage));
  EXPECT_EQ(leader.step(1003, peer(S::kReady, OperatorAct::kNone, true)), S::kEngaged);
  EXPECT_EQ(leader.step(2003, peer(S::kReady)), S::kEngaged);
  EXPECT_EQ(leader.step(2004, peer(S::kReady)), S::kHolding);
  EXPECT_EQ(leader.reason(), Reason::kTimeout);
}

TEST(Engagement, LeaderHoldsWhenTheFollowerLetsGo) {
  Engagement leader = started(Role::kLeader);
  leader.step(0, peer(S::kReady, OperatorAct::kEngage));
  leader.step(1, peer(S::kReady, OperatorAct::kNone, true));
  EXPECT_EQ(leader.step(2, peer(S::kReady)), S::kEngaged);  // the follower has not heard of it yet
  EXPECT_EQ(leader.step(3, peer(S::kEngaged)), S::kEngaged);
  EXPECT_EQ(leader.step(4, peer(S::kHolding)), S::kHolding);
  EXPECT_EQ(leader.reason(), Reason::kPeerLetGo);
}

TEST(Engagement, FollowerEngagesOnTheEdgeOnly) {
  Engagement follower = started(Role::kFollower);
  for (int k = 0; k < 50; ++k) EXPECT_EQ(follower.step(k, peer(S::kEngaged, OperatorAct::kNone, true)), S::kReady);
  follower.step(50, peer(S::kAligning, OperatorAct::kNone, true));
  EXPECT_EQ(follower.step(51, peer(S::kEngaged, OperatorAct::kNone, false)), S::kReady);
  EXPECT_EQ(follower.step(52, peer(S::kEngaged, OperatorAct::kNone, true)), S::kEngaged);
}

TEST(Engagement, AResumedStreamDoesNotTakeTheHandBack) {
  Engagement follower = started(Role::kFollower);
  follower.step(0, peer(S::kAligning, OperatorAct::kNone, true));
  ASSERT_EQ(follower.step(1, peer(S::kEngaged, OperatorAct::kNone, true)), S::kEngaged);
  EngagementInputs silent;
  ASSERT_EQ(follower.step(2, silent), S::kHolding);
  EXPECT_EQ(follower.reason(), Reason::kPeerSilent);
  for (int k = 3; k < 100; ++k) EXPECT_EQ(follower.step(k, peer(S::kEngaged, OperatorAct::kNone, true)), S::kHolding);
  follower.step(100, peer(S::kHolding, OperatorAct::kNone, true));
  EXPECT_EQ(follower.step(101, peer(S::kEngaged, OperatorAct::kNone, true)), S::kEngaged);
}

TEST(Engagement, FollowerNeverEngagesByItsOwnAct) {
  Engagement follower = started(Role::kFollower);
  EXPECT_EQ(follower.step(0, peer(S::kReady, OperatorAct::kEngage, true)), S::kReady);
}

TEST(Engagement, TheSelfTestTakesTwentySoundMillisecondsAndNeverLongerThanASecond) {
  Engagement sound(Role::kFollower, {});
  EXPECT_EQ(sound.state(), S::kOff);
  EngagementInputs in;
  in.device_valid = false;
  EXPECT_EQ(sound.step(0, in), S::kOff);
  EXPECT_EQ(sound.step(kMillisecond, {}), S::kSelfTest);
  EXPECT_EQ(sound.step(20 * kMillisecond, {}), S::kSelfTest);
  EXPECT_EQ(sound.step(21 * kMillisecond, {}), S::kReady);
  const auto ends = [](auto&& spoil, Reason reason) {
    Engagement machine(Role::kFollower, {});
    Nanoseconds now = 0;
    for (; machine.state() != S::kFault && now < 2 * kSecond; now += kMillisecond) {
      EngagementInputs one;
      spoil(one, now);
      ASSERT_NE(machine.step(now, one), S::kReady);
    }
    EXPECT_EQ(now, kSecond + 2 * kMillisecond);
    EXPECT_EQ(machine.reason(), reason);
  };
  ends([](EngagementInputs& one, Nanoseconds) { one.in_range = false; }, Reason::kOutOfRange);
  ends([](EngagementInputs& one, Nanoseconds) { one.at_rest = false; }, Reason::kNotAtRest);
  ends([](EngagementInputs& one, Nanoseconds) { one.line = LineQuality::kSlow; }, Reason::kLineSlow);
  ends([](EngagementInputs& one, Nanoseconds) { one.line = LineQuality::kUnknown; }, Reason::kLineSlow);
  ends([](EngagementInputs& one, Nanoseconds now) { one.at_rest = now % (15 * kMillisecond) != 0; },
       Reason::kNotAtRest);
}

TEST(Engagement, StopAndFaultEndByAnActOfTheSameSideAndThroughTheSelfTest) {
  for (const Role role : {Role::kLeader, Role::kFollower}) {
    for (const bool fault : {true, false}) {
      Engagement machine = started(role);
      EngagementInputs in = act(fault ? OperatorAct::kNone : OperatorAct::kStop);
      in.finite = !fault;
      const S latched = fault ? S::kFault : S::kStopped;
      ASSERT_EQ(machine.step(0, in), latched);
      Nanoseconds now = 0;
      for (int state = 0; state <= static_cast<int>(kLastState); ++state) {
        for (const OperatorAct one :
             {OperatorAct::kNone, OperatorAct::kEngage, OperatorAct::kHold, OperatorAct::kStop, OperatorAct::kHome}) {
          for (const bool valid : {true, false}) {
            in = peer(static_cast<S>(state), one, true);
            in.device_valid = valid;
            ASSERT_EQ(machine.step(++now, in), latched);
          }
        }
      }
      EXPECT_EQ(machine.step(++now, act(OperatorAct::kReset)), S::kSelfTest);
      EXPECT_EQ(machine.step(++now, {}), S::kReady);
    }
  }
}

TEST(Engagement, ThePatientsStopIsNotUndoneByTheTherapist) {
  Engagement leader = started(Role::kLeader);
  leader.step(0, peer(S::kReady, OperatorAct::kEngage));
  leader.step(1, peer(S::kReady, OperatorAct::kNone, true));
  leader.step(2, peer(S::kEngaged));
  EXPECT_EQ(leader.step(3, peer(S::kStopped)), S::kHolding);
  EXPECT_EQ(leader.reason(), Reason::kPeerStopped);
  EXPECT_EQ(leader.step(4, peer(S::kStopped, OperatorAct::kEngage)), S::kHolding);
  EXPECT_EQ(leader.step(5, peer(S::kStopped, OperatorAct::kReset)), S::kHolding);
}

TEST(Engagement, HomingNeedsItsActAndEndsByAnyOther) {
  const EngagementParams params{.homing = true};
  Engagement unknown = started(Role::kFollower, params);
  EXPECT_EQ(unknown.state(), S::kSelfTest) << "tested, but its angle is not known";
  EXPECT_EQ(unknown.step(0, peer(S::kEngaged, OperatorAct::kEngage, true)), S::kSelfTest);
  EXPECT_EQ(started(Role::kFollower).step(0, act(OperatorAct::kHome)), S::kReady) << "an angle that is known stays";
  for (const OperatorAct one : {OperatorAct::kEngage, OperatorAct::kHold, OperatorAct::kReset, OperatorAct::kHome}) {
    Engagement machine = unknown;
    ASSERT_EQ(machine.step(1, act(OperatorAct::kHome)), S::kHoming);
    EXPECT_EQ(machine.step(2, act(one)), S::kFault);
    EXPECT_EQ(machine.reason(), Reason::kOperator);
  }
  Engagement done = unknown;
  done.step(1, act(OperatorAct::kHome));
  EngagementInputs in;
  in.homing = HomingProgress::kDone;
  EXPECT_EQ(done.step(2, in), S::kReady);
  done.step(3, act(OperatorAct::kStop));
  done.step(4, act(OperatorAct::kReset));
  EXPECT_EQ(done.step(5, {}), S::kReady) << "a stop forgets no angle";
  in = {};
  in.device_valid = false;
  EXPECT_EQ(done.step(6, in), S::kOff);
  for (int k = 7; k < 20; ++k) EXPECT_EQ(done.step(k, {}), S::kSelfTest) << "a device that was away does";
}

// Every row in Markdown, as STATES.md holds it.
std::string in_markdown() {
  const auto capital = [](std::string name) {
    name[0] = static_cast<char>(std::toupper(name[0]));
    return name;
  };
  std::string text = "| from | to | when | whose | reason |\n|---|---|---|---|---|\n";
  for (const Transition& row : Engagement::transitions()) {
    std::string from, others;
    int count = 0;
    for (int k = 0; k <= static_cast<int>(kLastState); ++k) {
      const S state = static_cast<S>(k);
      std::string& list = row.from.has(state) ? from : others;
      list += (list.empty() ? "" : ", ") + capital(name_of(state));
      count += row.from.has(state);
    }
    if (count > 4) from = "all but " + others;
    constexpr const char* kWhose[] = {"either", "therapist", "patient"};
    text += "| " + from + " | " + capital(name_of(row.to)) + " | " + row.when + " | " +
            kWhose[static_cast<int>(row.whose)] + " | " +
            (row.reason == Reason::kNone ? "what it found" : name_of(row.reason)) + " |\n";
  }
  return text;
}

TEST(Engagement, TheTableInTheDocumentIsTheOneInTheCode) {
  std::ostringstream document;
  document << std::ifstream(FARHAND_STATES).rdbuf();
  EXPECT_NE(document.str().find(in_markdown()), std::string::npos) << "common/STATES.md must hold this table:\n\n"
                                                                   << in_markdown();
  for (int k = 0; k <= static_cast<int>(kLastState); ++k) {
    const S state = static_cast<S>(k);
    std::string name = name_of(state);
    name[0] = static_cast<char>(std::toupper(name[0]));
    const std::string row = "| " + name + " | " + std::to_string(k) + " | " + name_of(asks_of(state)) + " |";
    EXPECT_NE(document.str().find(row), std::string::npos) << "no row begins with " << row;
  }
}

}  // namespace
}  // namespace farhand
