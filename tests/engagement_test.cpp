// The state machine and the blend: nothing moves at start, engaging needs an act, nothing jumps, and the table in
// STATES.md is the one in the code.
#include "common/station/engagement.hpp"

#include <gtest/gtest.h>

#include <deque>
#include <fstream>
#include <map>
#include <random>
#include <sstream>
#include <string>

#include "common/station/blend.hpp"

namespace farhand {
namespace {

using S = StationState;
using J1 = Joints<1>;

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

// What one side may meet, as weather: rates that change now and then, so that the rare ways are walked too.
class Weather {
 public:
  explicit Weather(std::uint64_t seed) : random_(seed) {}

  EngagementInputs next() {
    if (random_() % 128 == 0) turn();
    EngagementInputs in;
    if (happens(kAct) || random_() % 64 == 0) in.act = static_cast<OperatorAct>(random_() % 8);
    in.device_valid = !happens(kLost);
    in.finite = !happens(kNotFinite);
    in.in_range = !happens(kOutOfRange);
    in.at_rest = !happens(kNotAtRest);
    if (happens(kLine)) in.line = static_cast<LineQuality>(1 + random_() % 3);
    if (in.line == LineQuality::kLags) in.device_valid = false;
    if (happens(kHomed)) in.homing = random_() % 2 == 0 ? HomingProgress::kBlocked : HomingProgress::kDone;
    if (happens(kIdentified)) in.identifying = static_cast<IdentifyingProgress>(1 + random_() % 3);
    if (happens(kSwept)) in.sweeping = static_cast<SweepingProgress>(1 + random_() % 4);
    if (happens(kGuardFault)) in.guard_fault = Reason::kOutOfRange;
    in.limit_holds = happens(kPatientLimit);
    in.shaken = happens(kShaken);
    in.peer_alive = !happens(kSilent);
    if (happens(kPeerChanges))
      peer_ =
          gaps_ ? std::array{S::kEngaged, S::kHolding, S::kAligning}[random_() % 3] : static_cast<S>(random_() % 11);
    in.peer = peer_;
    in.aligned = !happens(kApart);
    if (happens(kPeerChanges))
      told_ = static_cast<std::uint32_t>(gaps_ && random_() % 8 != 0 ? ~0ull : random_()) & kGapBits;
    if (happens(kRestart)) ++session_;
    in.gap = {.without = happens(kLongGap) ? 20
                         : in.peer_alive   ? 0
                                           : 4 + static_cast<Nanoseconds>(random_() % 8),
              .session = session_,
              .told = told_,
              .slept = happens(kSleeps),
              .moved = happens(kMoves),
              .near = !happens(kApart),
              .slow = !happens(kMoves)};
    return in;
  }
  Nanoseconds pause() {
    if (random_() % 4096 == 0) return 61 * kSecond;
    return random_() % 32 == 0 ? 20 : 1;
  }

 private:
  enum Event {
    kAct,
    kLost,
    kNotFinite,
    kOutOfRange,
    kNotAtRest,
    kLine,
    kHomed,
    kIdentified,
    kSwept,
    kGuardFault,
    kPatientLimit,
    kShaken,
    kSilent,
    kPeerChanges,
    kApart,
    kRestart,
    kSleeps,
    kMoves,
    kLongGap,
    kEvents
  };
  bool happens(Event event) { return random_() % 1024 < rate_[event]; }
  void turn() {
    constexpr std::uint64_t kRates[] = {0, 0, 0, 0, 0, 4, 32, 512};
    for (std::uint64_t& rate : rate_) rate = kRates[random_() % 8];
    rate_[kApart] = 512 * (random_() % 3);
    gaps_ = random_() % 2 == 0;  // of the network, and little else
    if (gaps_) {
      rate_.fill(0);
      rate_[kSilent] = kRates[5 + random_() % 3];
      rate_[kPeerChanges] = 256;
      for (const Event one : {kLongGap, kSleeps, kMoves, kRestart}) rate_[one] = random_() % 16 == 0 ? 32 : 0;
    }
    if (!gaps_ && random_() % 32 == 0) rate_[std::array{kNotAtRest, kOutOfRange, kLine}[random_() % 3]] = 1024;
  }

  std::mt19937_64 random_;
  std::array<std::uint64_t, kEvents> rate_{};
  S peer_ = S::kReady;
  std::uint32_t told_ = 0, session_ = 1;
  bool gaps_ = false;
};

// Ten million steps: every transition is one of the table, every row of the table is taken, on each side that it is
// for, and what the table is meant to promise holds, whatever its rows say.
TEST(Engagement, InvariantsHoldOnRandomSequencesAndEveryRowIsTaken) {
  std::map<std::pair<const Transition*, Role>, std::uint64_t> taken;
  std::uint64_t steps = 0;
  for (int round = 0; round < 40; ++round) {
    const Role role = round % 2 == 0 ? Role::kLeader : Role::kFollower;
    const EngagementParams params{.timeout = 40,
                                  .self_test = 3,
                                  .self_test_limit = 12,
                                  .homing = round % 4 < 2,
                                  .homing_timeout = 40,
                                  .longest_gap = round % 5 == 4 ? 0 : 12,
                                  .identification = round % 8 < 6,
                                  .sweep = round % 16 < 12};
    Weather weather(static_cast<std::uint64_t>(round) + 1);
    Engagement machine(role, params);
    Nanoseconds now = 0, unsound = 0;  // when the device was last seen unsound, or the test began
    S last = machine.state();
    bool disengaged_since = false, homed = false;
    bool for_gap = false;       // it holds for a gap of the network, and nothing else has happened
    std::uint32_t session = 0;  // of the peer, before the gap
    std::deque<Nanoseconds> resumed;
    for (int k = 0; k < 250'000; ++k, ++steps) {
      now += weather.pause();
      const EngagementInputs in = weather.next();
      disengaged_since |= in.peer_alive && in.peer != S::kEngaged;
      if (!in.finite || !in.in_range || !in.at_rest) unsound = now;
      if (!in.device_valid) homed = false;
      const S next = machine.step(now, in);

      if (last == S::kHolding) {
        for_gap = for_gap && in.act == OperatorAct::kNone && !in.limit_holds && !in.shaken && !in.guard_fault &&
                  !in.gap.slept && !in.gap.moved && in.gap.without <= params.longest_gap && in.gap.session == session;
      }
      const Transition* row = machine.taken();
      if (row != nullptr && row->reason == Reason::kResumed) {
        ASSERT_TRUE(last == S::kHolding && for_gap && in.peer_alive && in.gap.near && in.gap.slow);
        ASSERT_TRUE(params.longest_gap > 0 && (in.gap.told != 0 || (role == Role::kLeader && in.peer == S::kEngaged)));
        while (!resumed.empty() && now - resumed.front() > 60 * kSecond) resumed.pop_front();
        resumed.push_back(now);
        ASSERT_LE(resumed.size(), 3u);
      }
      if (row != nullptr) {
        for_gap = last == S::kEngaged && next == S::kHolding && !in.gap.slept &&
                  (row->reason == Reason::kPeerSilent || row->reason == Reason::kPeerDeaf);
        session = in.gap.session;
      }
      ASSERT_EQ(row != nullptr, next != last);
      if (row != nullptr) {
        ASSERT_TRUE(row->from.has(last));
        ASSERT_EQ(row->to, next);
        ++taken[{row, role}];
      }
      // Latches, and what is stronger than all.
      if (last == S::kFault || last == S::kStopped) {
        ASSERT_TRUE(next == last || next == S::kFault || (next == S::kSelfTest && in.act == OperatorAct::kReset));
      }
      if (last != S::kFault && (!in.finite || (role == Role::kFollower && in.guard_fault))) {
        ASSERT_EQ(next, S::kFault);
      }
      if (in.act == OperatorAct::kStop) {
        ASSERT_TRUE(next == S::kStopped || next == S::kFault);
      }
      if (!in.device_valid) {
        ASSERT_EQ(asks_of(next), Asks::kNothing);
      }
      // What moves, and what may begin to.
      if (asks_of(next) == Asks::kMotion) {
        ASSERT_TRUE(next == S::kHoming || next == S::kIdentifying || next == S::kSweeping || next == S::kAligning ||
                    next == S::kEngaged || next == S::kHolding);
        ASSERT_TRUE(last != S::kOff && last != S::kFault && last != S::kStopped);
        ASSERT_TRUE(last != S::kSelfTest || next == S::kHoming);
      }
      if (next != last && next == S::kHoming) {
        ASSERT_TRUE(last == S::kSelfTest && params.homing && !homed && in.act == OperatorAct::kHome);
      }
      if (next != last && next == S::kIdentifying) {
        ASSERT_TRUE(last == S::kReady && params.identification && in.act == OperatorAct::kIdentify);
      }
      if (next != last && next == S::kSweeping) {
        ASSERT_TRUE(last == S::kReady && role == Role::kFollower && params.sweep && in.act == OperatorAct::kSweep);
      }
      if (last == S::kSweeping) {
        ASSERT_TRUE(next == last || next == S::kReady || next == S::kFault || next == S::kStopped);
        ASSERT_TRUE(next != S::kReady || in.sweeping == SweepingProgress::kDone);
        ASSERT_TRUE(in.act == OperatorAct::kNone || next != last);
      }
      if (last == S::kIdentifying) {
        ASSERT_TRUE(next == last || next == S::kReady || next == S::kFault || next == S::kStopped);
        ASSERT_TRUE(next != S::kReady || in.identifying == IdentifyingProgress::kAsSaid);
      }
      if (next != last && (next == S::kHoming || (next == S::kReady && last == S::kSelfTest))) {
        ASSERT_GE(now - unsound, params.self_test);
      }
      if (next == S::kReady && last == S::kSelfTest) {
        ASSERT_TRUE(homed || !params.homing);
      }
      if (next != last && next == S::kAligning) {
        ASSERT_TRUE(role == Role::kLeader && in.peer_alive);
        ASSERT_EQ(in.act == OperatorAct::kEngage, row->reason != Reason::kResumed);
      }
      if (next != last && next == S::kEngaged) {
        ASSERT_TRUE(in.peer_alive && (in.aligned || row->reason == Reason::kResumed));
        ASSERT_EQ(last == S::kAligning, role == Role::kLeader);
        ASSERT_TRUE(role == Role::kLeader ||
                    (disengaged_since && in.peer == S::kEngaged && !in.limit_holds && !in.shaken));
      }
      if (next == S::kEngaged || next == S::kAligning) {
        ASSERT_TRUE(in.peer_alive && in.act != OperatorAct::kHold);
      }
      if (next == S::kEngaged && role == Role::kFollower) {
        ASSERT_EQ(in.peer, S::kEngaged);
      }

      if (next != last) {
        disengaged_since = false;
        unsound = now;
      }
      if (last == S::kHoming && next == S::kReady) homed = true;
      if (next == S::kFault) homed = false;
      last = next;
    }
  }
  std::printf("%llu steps\n", static_cast<unsigned long long>(steps));
  EXPECT_EQ(steps, 10'000'000u);
  for (const Transition& row : Engagement::transitions()) {
    using enum Transition::Whose;
    const std::uint64_t leader = taken[{&row, Role::kLeader}], follower = taken[{&row, Role::kFollower}];
    EXPECT_EQ(leader > 0, row.whose != kFollower) << row.when;
    EXPECT_EQ(follower > 0, row.whose != kLeader) << row.when;
    std::printf("%8llu %8llu  %-9s %s\n", static_cast<unsigned long long>(leader),
                static_cast<unsigned long long>(follower), name_of(row.to), row.when);
  }
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

TEST(Blend, IsContinuousAcrossEverySwitchAndEndsAtTheSource) {
  std::mt19937_64 random(5);
  const auto uniform = [&](double a, double b) {
    return a + (b - a) * (static_cast<double>(random() >> 11) * 0x1p-53);
  };
  const auto any = [&] { return Motion<1>{J1(uniform(-.5, .5)), J1(uniform(-1, 1)), J1(uniform(-2, 2))}; };
  Blend<1> blend(0.5, 0.3);
  Motion<1> last = blend.step({}, 1e-3);
  for (int round = 0; round < 10'000; ++round) {
    const Motion<1> source = any();
    blend.begin(last, source);
    const Motion<1> first = blend.step(source, 0.0);
    ASSERT_NEAR(first.x[0], last.x[0], 1e-15);
    ASSERT_NEAR(first.v[0], last.v[0], 1e-15);
    ASSERT_NEAR(first.f[0], last.f[0], 1e-15);
    const int steps = static_cast<int>(random() % 5000);
    Motion<1> now = first;
    for (int k = 0; k < steps; ++k) {
      const Motion<1> next = blend.step(source, 1e-3);
      ASSERT_LE(std::abs(next.x[0] - now.x[0]),
                1.5 * 1e-3 * std::max(0.3, std::abs(last.x[0] - source.x[0]) / 0.5) + 1e-12);
      now = next;
    }
    if (blend.done()) {
      ASSERT_EQ(now.x[0], source.x[0]);
      ASSERT_EQ(now.v[0], source.v[0]);
      ASSERT_EQ(now.f[0], source.f[0]);
    }
    last = now;
  }
}

// The velocity that it hands out is the slope of the position that it hands out.
TEST(Blend, PositionAndVelocityAreOneMotion) {
  Blend<1> blend(0.5, 0.3);
  const Motion<1> from{J1(0.3), J1(0.0), J1(0.0)}, to{};
  blend.begin(from, to);
  double x = from.x[0];
  for (int k = 0; k < 1000; ++k) {
    const Motion<1> a = blend.step(to, 0.5e-3), b = blend.step(to, 0.5e-3);
    ASSERT_NEAR((b.x[0] - x) / 1e-3, a.v[0], 1e-5);
    x = b.x[0];
  }
}

}  // namespace
}  // namespace farhand
