// The state machine over ten million random steps: what must always hold does, and every row of the table is taken.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <deque>
#include <map>
#include <random>

#include "common/station/engagement.hpp"

namespace farhand {
namespace {

using S = StationState;

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

}  // namespace
}  // namespace farhand
