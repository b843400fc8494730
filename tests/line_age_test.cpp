// A serial line that lags, in virtual time: whole sessions behind the MCU, in which commands or telemetry come later
// and later, or at once; and what is not to be taken for it.
#include "common/device/line_age.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <random>

#include "common/config/load.hpp"
#include "netem/lab/fault_rig.hpp"
#include "tests/support/unwinding.hpp"

namespace farhand {
namespace {

constexpr Nanoseconds kMs = kMillisecond;
constexpr Nanoseconds kAtOnce = 0;

// The therapist's arm presses on the hand with some 1 N m once both are engaged.
scene::Scene pressing(double tick_s) {
  scene::Scene scene = load_scene_text(R"(
architecture: FOUR_CHANNEL_CDOB_SDCV
duration_s: 10000
control { f_1_nm: 0.2 f_2_nm: 0.45 K_f_per_kgm2: 125 }
master { therapist { grip: FIRM intended { duration_s: 2.5 } intended { duration_s: 0.5 ramp_to_rad: 0.3 }
                     intended { duration_s: 10000 } } }
slave { device: SERIES_ELASTIC axis { torque_limit_nm: 3 } hand { stiffness_nm_per_rad: 5 } limits { session_s: 100000 } }
network {
  forward { delay_s: 0.03 distribution: CONSTANT }
  backward { delay_s: 0.03 distribution: CONSTANT }
}
)",
                                       "line.txtpb", {})
                           .scene;
  scene.set_tick_s(tick_s);
  return scene;
}

class Session {
 public:
  explicit Session(double tick_s = 0.001) : rig(pressing(tick_s)) {}

  StationState slave() const { return rig.slave.side->trace().state; }
  Reason why() const { return rig.slave.side->trace().reason; }
  bool engaged() const { return slave() == StationState::kEngaged; }
  SerialCounters line() const { return rig.slave.side->serial_counters(); }

  void run(Nanoseconds span) {
    for (const Nanoseconds end = rig.now + span; rig.now < end;) rig.tick();
  }
  // Both engaged, and the hand pressed.
  void press() {
    engage();
    for (int k = 0; k < 6000 && rig.torque() < 0.8; ++k) rig.tick();
    run(300 * kMs);
  }
  void engage() {
    for (int k = 0; k < 10'000; ++k) {
      const StationState master = rig.master.side->trace().state;
      if (master == StationState::kReady || master == StationState::kHolding) rig.act = OperatorAct::kEngage;
      rig.tick();
      if (engaged() && master == StationState::kEngaged) return;
    }
  }

  FaultRig rig;
};

enum class Direction { kToMcu, kFromMcu };

struct Lag {
  Direction way;
  Nanoseconds most;
  double growth_ms_per_s;  // kAtOnce: none, it is there at once
  double mcu_clock;

  Nanoseconds after(Nanoseconds since) const {
    if (growth_ms_per_s == kAtOnce) return most;
    return std::min(most, static_cast<Nanoseconds>(1e-3 * growth_ms_per_s * static_cast<double>(since)));
  }
  void put_on(Cable& cable, Nanoseconds since) const {
    (way == Direction::kToMcu ? cable.lag_to_mcu : cable.lag_from_mcu) = after(since);
  }
  std::string name() const {
    return std::string(way == Direction::kToMcu ? "to" : "from") + " the MCU " + std::to_string(most / kMs) +
           " ms by " + std::to_string(growth_ms_per_s) + " ms/s, clock " + std::to_string(mcu_clock);
  }
};

constexpr Nanoseconds kLimit = 20 * kMs;
// A command waits for up to a frame of the MCU, its echo for up to a tick: the line's own time differs by both.
constexpr Nanoseconds kGrain = 2 * kMs;

// How it ends, in ms after the lag passed 20 ms; nothing if it goes on. A line that is that late at once is so old 20
// ms later.
std::optional<double> off_after(const Lag& lag) {
  Session session;
  session.rig.cable.mcu_clock = lag.mcu_clock;
  session.press();
  EXPECT_TRUE(session.engaged()) << lag.name();
  EXPECT_EQ(session.line().warned, 0u) << lag.name();
  const Nanoseconds from = session.rig.now + kMs;
  std::optional<Nanoseconds> passed;
  for (Nanoseconds since = 0; !passed || since < *passed + kSecond; since += kMs) {
    lag.put_on(session.rig.cable, since);
    if (!passed && (lag.after(since) > kLimit || lag.after(since) == lag.most)) {
      passed = since + (lag.growth_ms_per_s == kAtOnce ? std::min(lag.most, kLimit) : 0);
    }
    session.rig.tick();
    if (!session.engaged()) {
      EXPECT_EQ(session.slave(), StationState::kOff) << lag.name();
      // What makes neither commands nor telemetry cease is known by its age alone.
      if (lag.growth_ms_per_s != kAtOnce) {
        EXPECT_EQ(session.why(), Reason::kLineLags) << lag.name();
      }
      if (!passed) {
        EXPECT_GE(lag.after(since), kLimit - kGrain) << lag.name();
        return 0;
      }
      return static_cast<double>(session.rig.now - from - *passed) / kMs;
    }
  }
  if (lag.most > 12 * kMs) {
    EXPECT_GT(session.line().warned, 0u) << lag.name();
  }
  return std::nullopt;
}

// The line of it: Off within 50 ms of passing 20 ms. A lag that is there at once passes 20 ms after 20 ms, so that it
// is Off within 70 ms of its step.
void expect_known(const Lag& lag, double& latest_ms) {
  const std::optional<double> after = off_after(lag);
  if (lag.most > kLimit) latest_ms = std::max(latest_ms, after.value_or(0));
  if (lag.most > kLimit) {
    ASSERT_TRUE(after) << lag.name();
    EXPECT_LE(*after, 50) << lag.name();
  } else if (lag.most < kLimit - kGrain) {
    EXPECT_FALSE(after) << lag.name() << ": Off after " << *after << " ms";
  }
}

TEST(LineAge, BeyondTwentyMillisecondsIsOffWithinFiftyEitherWayHoweverItGrew) {
  double latest_ms = 0;
  for (const Direction way : {Direction::kToMcu, Direction::kFromMcu}) {
    for (const Nanoseconds most : {16, 20, 32, 50, 100, 400}) {
      expect_known({way, most * kMs, kAtOnce, 1.0}, latest_ms);
      if (most > 20) expect_known({way, most * kMs, 100, most % 3 == 0 ? 1.005 : 0.995}, latest_ms);
    }
    expect_known({way, 16 * kMs, 10, 1.005}, latest_ms);
    expect_known({way, 24 * kMs, 10, 0.995}, latest_ms);
  }
  std::printf("Off at the latest %.0f ms after the line passed 20 ms\n", latest_ms);
}

TEST(NightlyLineAge, BeyondTwentyMillisecondsIsOffWithinFiftyAtEverySpeedAndClock) {
  double latest_ms = 0;
  for (const Direction way : {Direction::kToMcu, Direction::kFromMcu}) {
    for (const Nanoseconds most : {16, 20, 32, 50, 100, 400}) {
      for (const double growth : {0.1, 1.0, 10.0, 100.0, 0.0}) {
        for (const double clock : {0.995, 1.0, 1.005}) expect_known({way, most * kMs, growth, clock}, latest_ms);
      }
    }
  }
  std::printf("Off at the latest %.0f ms after the line passed 20 ms\n", latest_ms);
}

// The patient's stop at the box, pressed some time after the line began to lag: ms until the orthosis commands no
// torque any more, for good, and until its spring has none: from then on the hand swings by itself.
struct Stopped {
  double told_ms, spring_ms, line_ms;
  double free_by_ms;  // by the motor's speed
  bool ceased;        // the MCU had heard nothing new for longer than its watchdog waits
};
Stopped stop(const Lag& lag, Nanoseconds at) {
  Session session;
  session.rig.cable.mcu_clock = lag.mcu_clock;
  session.press();
  EXPECT_TRUE(session.engaged()) << lag.name();
  Stopped result{0, -1, 0, 0, false};
  const SeriesElasticParams::Actuator actuator;
  constexpr double kHand = 5;  // N m/rad
  for (Nanoseconds since = 0; since < at + 2 * kSecond; since += kMs) {
    lag.put_on(session.rig.cable, since);
    if (since == at) {
      session.rig.patient_act = OperatorAct::kStop;
      result.line_ms = 1.5 + (lag.way == Direction::kToMcu ? static_cast<double>(lag.after(since)) / kMs : 0);
      result.ceased = lag.way == Direction::kToMcu && lag.growth_ms_per_s == kAtOnce && lag.most > kLimit;
    }
    session.rig.tick();
    const double ms = static_cast<double>(since - at) / kMs;
    const double torque = std::abs(session.rig.orthosis()->world().truth().spring_torque);
    const bool free = torque < kUnwoundNm;
    if (session.rig.orthosis()->core().torque_command() != 0) {
      const double at_best = fastest_unwinding_s(actuator, kHand, torque);
      result.told_ms = std::max(0.0, ms + 1);
      result.free_by_ms = ms + 1 + 1e3 * (at_best + swing_s(actuator, kHand) + kUnwindingLoopS);
    }
    if (since < at) continue;
    if (result.spring_ms < 0 && free) result.spring_ms = ms;
  }
  return result;
}

void expect_stopped(const Lag& lag, Nanoseconds at) {
  const Stopped s = stop(lag, at);
  const double bound = s.ceased ? s.line_ms < 70 ? s.line_ms + 22 : 20 + 50 + 2 : 2 + s.line_ms + 20;
  const std::string name = lag.name() + ", stopped after " + std::to_string(at / kMs) + " ms";
  EXPECT_LE(s.told_ms, bound) << name;
  // Then the spring unwinds, as fast as the motor turns.
  EXPECT_GE(s.spring_ms, 0) << name;
  EXPECT_LE(s.spring_ms, s.free_by_ms) << name;
  std::printf("%-60s told %4.0f of %4.0f ms, spring %4.0f of %4.0f ms\n", name.c_str(), s.told_ms, bound, s.spring_ms,
              s.free_by_ms);
}

TEST(LineAge, ThePatientsStopIsNoLaterThanTheLineHoweverItLags) {
  for (const Direction way : {Direction::kToMcu, Direction::kFromMcu}) {
    for (const Nanoseconds most : {16, 50, 400}) {
      for (const Nanoseconds at : {0, 15, 60}) expect_stopped({way, most * kMs, kAtOnce, 1.0}, at * kMs);
    }
    expect_stopped({way, 400 * kMs, 100, 1.005}, 150 * kMs);
    expect_stopped({way, 400 * kMs, 100, 0.995}, 250 * kMs);
  }
}

TEST(LineAge, OneThatNeedsMoreThanEightMillisecondsIsRefusedInSelfTest) {
  for (const auto& slow : {+[](Cable& c) { c.lag_to_mcu = 16 * kMs; }, +[](Cable& c) { c.lag_from_mcu = 6 * kMs; },
                           +[](Cable& c) { c.lag_to_mcu = 400 * kMs; },
                           +[](Cable& c) { c.latency_timer = 16 * kMs, c.collects = 1000; }}) {
    Session session;
    slow(session.rig.cable);
    session.run(1500 * kMs);
    EXPECT_EQ(session.slave(), StationState::kFault);
    EXPECT_EQ(session.why(), Reason::kLineSlow);
    session.rig.cable = {};
    session.run(3 * kSecond);  // what queued up leaves no faster than a line carries it
    EXPECT_EQ(session.slave(), StationState::kFault) << "latched";
    session.rig.patient_act = OperatorAct::kReset;
    session.run(1500 * kMs);
    EXPECT_EQ(session.slave(), StationState::kReady) << name_of(session.why());
  }
}

// What a line needs is known to a tick only, and a tick may be as long as a scene may make it.
TEST(LineAge, OfLongerTicksAGoodLineIsGoodAndOneThatLagsIsKnown) {
  for (const int tick_ms : {2, 3, 4, 5}) {
    Session session(1e-3 * tick_ms);
    session.press();
    ASSERT_TRUE(session.engaged()) << tick_ms << " ms: " << name_of(session.why());
    session.run(5 * kSecond);
    ASSERT_TRUE(session.engaged()) << tick_ms << " ms: " << name_of(session.why());
    const SerialCounters good = session.line();
    EXPECT_LE(good.need_s, 0.008) << tick_ms;
    EXPECT_LE(good.most_age_s, good.need_s + LineAge::kWarned) << tick_ms;
    EXPECT_EQ(good.warned, 0u) << tick_ms;
    EXPECT_FALSE(good.blind) << tick_ms;
    const Nanoseconds from = session.rig.now;
    session.rig.cable.lag_to_mcu = 50 * kMs;
    while (session.engaged() && session.rig.now < from + kSecond) session.rig.tick();
    EXPECT_EQ(session.slave(), StationState::kOff) << tick_ms;
    EXPECT_LE(session.rig.now - from, 20 * kMs + 50 * kMs) << tick_ms;
    std::printf("tick %d ms: line needs %.1f ms, takes up to %.1f; Off %.0f ms after it lags by 50\n", tick_ms,
                1e3 * good.need_s, 1e3 * good.most_age_s, 1e-6 * static_cast<double>(session.rig.now - from));
  }
}

// Also for the therapist's device behind an MCU, whose scene may be one of a direct drive.
TEST(LineAge, ATickThatNoLineCanKeepIsRefusedBeforeTheLoop) {
  for (const double tick_s : {0.0008, 0.006, 0.02}) EXPECT_THROW(Session{tick_s}, std::invalid_argument) << tick_s;
}

// A host whose every tick is late by `every` - 1 ms.
void run_late(Session& session, int every, Nanoseconds span) {
  int k = 0;
  for (const Nanoseconds end = session.rig.now + span; session.rig.now < end;) {
    session.rig.slave.runs = k++ % every == 0;
    session.rig.tick();
  }
  session.rig.slave.runs = true;
}

// However late it looks, it knows how long the line took at the most.
TEST(LineAge, AHostThatIsAlwaysLateIsNotTakenForALineThatIs) {
  for (const int every : {2, 3, 4}) {
    Session session;
    run_late(session, every, 1500 * kMs);
    EXPECT_EQ(session.slave(), StationState::kReady) << every << ": " << name_of(session.why());
  }
  for (const int every : {12, 20, 40}) {
    Session session;
    run_late(session, every, 1500 * kMs);
    EXPECT_EQ(session.slave(), StationState::kFault) << every;
    EXPECT_TRUE(session.line().blind) << every;
    EXPECT_STREQ(why_of(*session.rig.slave.side), "this PC looks too late at its serial line");
  }
  Session session;
  session.rig.cable.lag_to_mcu = 16 * kMs;
  session.run(1500 * kMs);
  EXPECT_FALSE(session.line().blind) << "the line is slow, and the host is not";
  EXPECT_STREQ(why_of(*session.rig.slave.side), name_of(Reason::kLineSlow));
}

// What a line is said to take was seen by a look in time, or is the least that a late one proves.
TEST(LineAge, ALateLookThatKnowsNothingOfTheLineSaysNothingOfIt) {
  Session session;
  session.rig.cable.lag_from_mcu = 2 * kMs;
  session.press();
  ASSERT_TRUE(session.engaged());
  const double usual = session.line().age_s;
  for (int k = 0; k < 4000; ++k) {
    session.rig.slave.runs = k % 40 > 8;  // 10 ms from look to look, now and then
    session.rig.tick();
    ASSERT_GE(session.line().age_s, usual - 0.002) << k;
    EXPECT_FALSE(session.line().blind);
  }
  EXPECT_TRUE(session.engaged()) << name_of(session.why());
  run_late(session, 9, 400 * kMs);
  EXPECT_TRUE(session.line().blind) << "no look was in time any more";
  session.run(100 * kMs);
  EXPECT_FALSE(session.line().blind);
}

// An honest adapter with a latency timer of 16 ms, which is full before it is over, and a host that stalls. span: of
// virtual time. A host that is away for longer than the MCU's watchdog waits feels its torque sag, and the session goes
// on.
void expect_no_false_off(Nanoseconds span, Nanoseconds stall, double mcu_clock) {
  Session session;
  session.rig.cable.latency_timer = 16 * kMs;
  session.rig.cable.mcu_clock = mcu_clock;
  session.press();
  session.run(3 * kSecond);
  ASSERT_TRUE(session.engaged());
  EXPECT_LE(session.line().need_s, 0.008);
  EXPECT_EQ(session.line().sagged, 0u);
  std::mt19937_64 random(7);
  const auto hand = [&] { return session.rig.orthosis()->world().truth(); };
  const double pressed = hand().f;
  double torque = 0, least = pressed, speed = 0, power = 0;
  int stalls = 0, offs = 0;
  Nanoseconds next = session.rig.now + kSecond;
  for (const Nanoseconds end = session.rig.now + span; session.rig.now < end;) {
    const bool away = session.rig.now >= next && session.rig.now < next + stall;
    session.rig.slave.runs = !away;
    const bool was = session.engaged();
    session.rig.tick();
    torque = std::max(torque, hand().f), least = std::min(least, hand().f);
    speed = std::max(speed, std::abs(hand().v)), power = std::max(power, hand().f * hand().v);
    if (was && !session.engaged()) ++offs;
    ASSERT_NE(session.why(), Reason::kLineLags) << "after " << stalls << " stalls";
    ASSERT_NE(session.why(), Reason::kLineSlow);
    if (!away && session.rig.now >= next + stall) {
      ++stalls;
      next = session.rig.now + 200 * kMs + static_cast<Nanoseconds>(random() % 4000) * kMs;
    }
    const StationState master = session.rig.master.side->trace().state;
    if (!session.engaged() && master == StationState::kHolding) session.rig.act = OperatorAct::kEngage;
  }
  EXPECT_GT(stalls, static_cast<int>(span / (4300 * kMs)));
  EXPECT_EQ(offs, 0);
  // Without a command for more than 20 ms the torque sags, and comes back without more than there was.
  EXPECT_EQ(session.line().sagged, stall > 20 * kMs ? static_cast<std::uint64_t>(stalls) : 0);
  EXPECT_LE(torque, pressed + 0.1);
  EXPECT_LE(speed, 4);
  EXPECT_LE(power, 2);
  std::printf(
      "%d stalls of %d ms, %d sessions ended; line %.1f to %.1f ms; %.2f to %.2f N m where %.2f were pressed, %.2f "
      "rad/s, %.2f W\n",
      stalls, static_cast<int>(stall / kMs), offs, 1e3 * session.line().need_s, 1e3 * session.line().most_age_s, least,
      torque, pressed, speed, power);
}

TEST(LineAge, AnHonestAdapterAndAHostThatStallsAreNoLagForAMinute) {
  expect_no_false_off(60 * kSecond, 16 * kMs, 1.0);
  expect_no_false_off(60 * kSecond, 30 * kMs, 0.995);
}

TEST(NightlyLineAge, AnHonestAdapterAndAHostThatStallsAreNoLagForAnHour) {
  for (const double clock : {0.995, 1.005}) {
    for (const Nanoseconds stall : {16, 30}) expect_no_false_off(3600 * kSecond, stall * kMs, clock);
  }
}

}  // namespace
}  // namespace farhand
