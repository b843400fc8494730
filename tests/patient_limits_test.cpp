// What the patient's box allows: the closed forms of its limits, and what leaves its last gate whatever is asked. Whole
// sessions: limited_session_test.cpp.
#include "common/station/patient_limits.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <limits>
#include <random>

#include "common/law/acceleration_law.hpp"
#include "common/runtime/live_status.hpp"
#include "common/station/limits.hpp"
#include "common/station/patient_guard.hpp"
#include "common/station/person_bound.hpp"
#include "tests/support/uniform.hpp"

namespace farhand {
namespace {

using J1 = Joints<1>;
constexpr double kDt = 1e-3;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

class Draw {
 public:
  explicit Draw(std::uint64_t seed) : bits_(seed) {}
  double operator()(double low, double high) { return uniform(bits_, low, high); }

 private:
  std::mt19937_64 bits_;
};

// ---- Warmth: the four facts of Mali & Munih 2006, III-C, against the exponential.

TEST(MotorHeat, OneAmpereEndsJustAtTheLimit) {
  MotorHeat heat({}, kDt);
  for (int s = 0; s < 20000; ++s) {
    heat.step(1.0, 1000);
    const double t = s + 1.0;
    ASSERT_NEAR(heat.share(), -std::expm1(-t / heat.time_constant_s()), 1e-12);
    ASSERT_LE(heat.surface_c(), 41.0);
  }
  EXPECT_NEAR(heat.surface_c(), 41.0, 1e-6);
}

TEST(MotorHeat, TwoAmpereFromColdGetThereInFiveMinutes) {
  MotorHeat heat({}, kDt);
  for (int k = 0; k < 300'000 - 1; ++k) heat.step(2.0, 1);
  EXPECT_LT(heat.surface_c(), 41.0);
  heat.step(2.0, 1);
  EXPECT_NEAR(heat.surface_c(), 41.0, 1e-9);
  EXPECT_NEAR(heat.time_constant_s(), 300.0 / std::log(4.0 / 3.0), 1e-9);
}

// The paper says "approximately 40 min" below 25 deg C; the room that the default names makes it so to the second.
TEST(MotorHeat, CoolsBelowTwentyFiveDegreesInFortyMinutes) {
  MotorHeat heat({}, kDt);
  heat.start(41.0);
  EXPECT_DOUBLE_EQ(heat.share(), 1.0);
  double minutes = 0;
  while (heat.surface_c() > 25.0) {
    heat.step(0.0, 1000);
    minutes += 1.0 / 60;
  }
  EXPECT_NEAR(minutes, 40.0, 0.5);
}

TEST(MotorHeat, MissedTicksAreOneExactStep) {
  MotorHeat ticked({}, kDt), skipped({}, kDt);
  for (int k = 0; k < 1000; ++k) ticked.step(1.7, 1);
  skipped.step(1.7, 1000);
  EXPECT_NEAR(ticked.share(), skipped.share(), 1e-12);
}

// ---- A sliding minute in 61 numbers: never below any 60 s, never above 61 s.

TEST(SlidingMinute, LiesBetweenTheLastSixtyAndSixtyOneSeconds) {
  constexpr double kStep = 0.01;
  Draw draw(3);
  SlidingMinute minute(kStep);
  std::deque<double> past;  // newest first
  for (int k = 0; k < 40'000; ++k) {
    const double amount = draw(0, 1) < 0.1 ? draw(0, 5) : 0.0;
    minute.add(amount, 1);
    past.push_front(amount);
    if (past.size() > 6200) past.pop_back();
    if (k % 7 != 0) continue;
    double low = 0, high = 0;
    for (std::size_t i = 0; i < past.size(); ++i) {
      if (i < 6000) low += past[i];
      if (i < 6101) high += past[i];
    }
    ASSERT_GE(minute.sum(), low - 1e-9) << k;
    ASSERT_LE(minute.sum(), high + 1e-9) << k;
  }
}

TEST(SlidingMinute, ForgetsOverALongGap) {
  SlidingMinute minute(kDt);
  for (int k = 0; k < 5000; ++k) minute.add(1e-3, 1);
  EXPECT_NEAR(minute.sum(), 5.0, 1e-9);
  minute.add(0.0, 1'000'000);
  EXPECT_EQ(minute.sum(), 0.0);
}

// ---- The gates.

// Whatever is asked, NaN and missed ticks included, the reference stays in its range, and neither its velocity nor the
// change of that exceeds its limit.
TEST(ReferenceGate, ObeysEveryLimitAtEveryTickWhateverIsAsked) {
  Draw draw(17);
  for (int round = 0; round < 200; ++round) {
    const GateParams p{.torque = draw(0.3, 4),
                       .velocity = draw(0.5, 5),
                       .range_min = draw(-0.4, -0.1),
                       .range_max = draw(0.1, 0.4),
                       .acceleration = draw(0, 1) < 0.5 ? draw(1, 50) : draw(50, 5000)};
    ReferenceGate<1> gate(p, kDt);
    gate.reset(J1(draw(p.range_min, p.range_max)));
    Motion<1> last = gate.applied();
    double speed = 0, at = 0, drift = 0;
    for (int k = 0; k < 500; ++k) {
      drift = 0.99 * drift + draw(-0.3, 0.3);
      at += kDt * drift;
      Motion<1> wish{J1(at), J1(drift), J1(draw(-9, 9))};
      if (draw(0, 1) < 0.02) wish.x[0] = draw(-5, 5);
      if (draw(0, 1) < 0.02) at = draw(-0.5, 0.5);
      if (draw(0, 1) < 0.02) wish.v[0] = kNan;
      const int ticks = draw(0, 1) < 0.05 ? 1 + static_cast<int>(draw(0, 30)) : 1;
      const double period = kDt * ticks;
      const Motion<1> out = gate.pass(wish, ticks);
      const double moves = (out.x[0] - last.x[0]) / period, slack = 1e-12 / period;
      ASSERT_TRUE(out.finite());
      ASSERT_LE(std::abs(moves), p.velocity + slack);
      ASSERT_LE(std::abs(moves - speed), p.acceleration * period + slack) << round << ' ' << k;
      ASSERT_GE(out.x[0], p.range_min);
      ASSERT_LE(out.x[0], p.range_max);
      ASSERT_LE(std::abs(out.v[0]), p.velocity);
      ASSERT_LE(std::abs(out.v[0] - last.v[0]), p.acceleration * period * (1 + 1e-12));
      ASSERT_LE(std::abs(out.f[0]), p.torque);
      ASSERT_EQ((gate.active() & kLimitNotFinite) != 0, !wish.finite());
      speed = moves;
      last = out;
    }
  }
}

// From rest to rest over d under acceleration a no way is quicker than 2 sqrt(d/a): the gate takes that and two ticks
// for starting and ending between ticks, and does not overshoot.
TEST(ReferenceGate, AStepIsFollowedInTheShortestTimeWithoutOvershoot) {
  for (const double d : {0.001, 0.02, 0.1, 0.3}) {
    ReferenceGate<1> gate({.velocity = 100, .range_min = -1, .range_max = 1, .acceleration = 20}, kDt);
    gate.reset(J1(0.0));
    int ticks = 0;
    while (gate.applied().x[0] != d && ticks < 10'000) {
      gate.pass({J1(d), J1(0.0), J1(0.0)});
      ++ticks;
      ASSERT_LE(gate.applied().x[0], d);
    }
    EXPECT_LE(ticks, std::ceil(2 * std::sqrt(d / 20) / kDt) + 3) << d;
    EXPECT_GE(ticks, std::floor(2 * std::sqrt(d / 20) / kDt) - 1) << d;
    gate.pass({J1(d), J1(0.0), J1(0.0)});
    EXPECT_EQ(gate.applied().x[0], d);
    EXPECT_EQ(gate.active(), 0u);
  }
}

TEST(ReferenceGate, WhatIsWithinTheLimitsPassesUnchanged) {
  ReferenceGate<1> gate({.acceleration = 1000}, kDt), wide({}, kDt);
  gate.reset(J1(0.0));
  wide.reset(J1(0.0));
  const double count = 2 * std::numbers::pi / 20000;
  for (int k = 0; k < 20'000; ++k) {
    const double x = std::round(0.25 * std::sin(kDt * k * 3.0) / count) * count;
    const Motion<1> wish{J1(x), J1(0.75 * std::cos(kDt * k * 3.0)), J1(0.1)};
    const Motion<1> out = gate.pass(wish), same = wide.pass(wish);
    ASSERT_EQ(out.x[0], same.x[0]) << k;
    ASSERT_EQ(out.v[0], k == 0 ? 0.75 : same.v[0]) << k;
    ASSERT_EQ(gate.active(), 0u) << k;
  }
}

TEST(PersonBound, AccelerationAskedForEndsAtTheLimitsOfAnAxisThatDoesWhatItIsAskedFor) {
  Draw draw(23);
  for (int round = 0; round < 100; ++round) {
    const GateParams gate{.range_min = -draw(0.1, 1), .range_max = draw(0.1, 1), .acceleration = draw(100, 5000)};
    const PersonBoundParams p{.speed = draw(0.5, 5), .power = draw(0.5, 5)};
    PersonBound<1> bound(p, gate, 4e-3, Cutoff::rad_s(200), 250, kDt);
    Motion<1> local;
    for (int k = 0; k < 2000; ++k) {
      local.f[0] = draw(0, 1) < 0.9 ? 0.0 : draw(-3, 3);
      const J1 a = bound.step(J1(draw(0, 1) < 0.5 ? 1e4 : draw(-1e4, 1e4)), local, local.f, local.f);
      ASSERT_LE(std::abs(a[0]), gate.acceleration);
      local.v += kDt * a;
      local.x += kDt * local.v;
      ASSERT_LE(std::abs(local.v[0]), p.speed * (1 + 1e-12));
      ASSERT_LE(local.x[0], gate.range_max + 1e-3);
      ASSERT_GE(local.x[0], gate.range_min - 1e-3);
    }
    TorqueGate<1> last(gate, kDt);
    EXPECT_EQ(last.pass(bound.step(J1(kNan), local, local.f, local.f), J1(0.0))[0], 0.0);
  }
}

TEST(PersonBound, SpeedIsBoundedByPowerOverWhatResists) {
  const GateParams gate{.range_min = -10, .range_max = 10};
  const PersonBoundParams p{.speed = 4, .power = 2};
  for (const double f : {0.5, 1.0, 2.0, 3.0}) {
    PersonBound<1> bound(p, gate, 4e-3, Cutoff::rad_s(200), 250, kDt);
    Motion<1> local;
    local.f[0] = f;
    for (int k = 0; k < 1000; ++k) {
      local.v += kDt * bound.step(J1(1e3), local, local.f, local.f);
      local.x += kDt * local.v;
    }
    EXPECT_NEAR(local.v[0], 2 / (f + 0.1), 1e-3);
    EXPECT_LE(f * local.v[0], 2.0);
    EXPECT_EQ(bound.active(), kLimitPower);
  }
}

TEST(PersonBound, WhatIsFarFromEveryLimitPassesToTheBit) {
  Draw draw(24);
  PersonBound<1> bound({.speed = 4, .power = 2}, {}, 4e-3, Cutoff::rad_s(200), 250, kDt);
  for (int k = 0; k < 10'000; ++k) {
    Motion<1> local;
    local.x[0] = draw(-0.2, 0.2);
    local.v[0] = draw(-1, 1);
    local.f[0] = draw(-0.5, 0.5);
    const J1 asked(draw(-40, 40));
    ASSERT_EQ(bound.step(asked, local, local.f, local.f)[0], asked[0]);
    ASSERT_EQ(bound.active(), 0u);
  }
}

// ---- Reactions.

TEST(DoseLimits, SoftStartIsARampFromNothing) {
  DoseLimits limits({.soft_start_s = 0.5}, kDt);
  EXPECT_EQ(limits.step({.driven = false}).gain, 0.0);
  for (int k = 1; k <= 600; ++k) ASSERT_NEAR(limits.step({.driven = true}).gain, std::min(1.0, k * kDt / 0.5), 1e-12);
  for (int k = 1; k <= 600; ++k) {
    ASSERT_NEAR(limits.step({.driven = false}).gain, std::max(0.0, 1 - k * kDt / 0.5), 1e-12);
  }
}

TEST(DoseLimits, PowerLowersTheGainAndGivesItBackSlowly) {
  DoseLimits limits({.power_w = 2, .energy_j = 1e9, .soft_start_s = 0.5}, kDt);
  for (int k = 0; k < 600; ++k) limits.step({.driven = true});
  const auto at = [&](double power, int ticks) {
    for (int k = 1; k < ticks; ++k) limits.step({.power_w = power, .driven = true});
    return limits.step({.power_w = power, .driven = true});
  };
  EXPECT_EQ(at(1.79, 400).warnings, 0u);
  const LimitVerdict near = at(1.8, 400);
  EXPECT_EQ(near.warnings, static_cast<std::uint32_t>(kLimitPower));
  EXPECT_EQ(near.limits, 0u);
  EXPECT_EQ(near.gain, 1.0);
  EXPECT_NEAR(at(1.95, 400).gain, 0.5, 1e-9);
  EXPECT_NEAR(at(2.0, 400).gain, 0.0, 1e-9);
  EXPECT_EQ(at(-9.0, 400).limits, 0u);  // what the hand gives is not delivered to it
  at(2.0, 400);
  // 5 % of it are gone after 1/k_B ln(1/0.95): a tick.
  const double from = at(0.0, 1).gain;
  EXPECT_NEAR(at(0.0, 100).gain, from + 100 * kDt / 0.5, 1e-9);
}

// From 0.89 of the limit: 1.5 times it is nothing in a tick, and too much in three.
TEST(DoseLimits, PowerCountsByItsMeanOverTheTimeInWhichTheBoundSlowsDown) {
  const auto after = [](double power, int ticks, int each) {
    DoseLimits limits({.power_w = 2, .energy_j = 1e9, .soft_start_s = 0.5}, kDt);
    LimitVerdict verdict;
    for (int k = 0; k < 600; ++k) verdict = limits.step({.power_w = 1.78, .driven = true});
    for (int k = 0; k < ticks; k += each) verdict = limits.step({.power_w = power, .driven = true, .ticks = each});
    return verdict;
  };
  EXPECT_EQ(after(3.0, 1, 1).gain, 1.0);
  EXPECT_EQ(after(3.0, 1, 1).limits, 0u);
  EXPECT_EQ(after(3.0, 3, 1).gain, 0.0);
  EXPECT_EQ(after(3.0, 3, 1).limits, static_cast<std::uint32_t>(kLimitPower));
  EXPECT_EQ(after(3.0, 3, 3).gain, 0.0);  // missed ticks count
}

// What it scales is what the network asks for; damping and giving way stay.
TEST(PatientGuard, GainScalesTheNetworksShareAndNothingElse) {
  const FourChannelGains K;
  Draw draw(5);
  for (int k = 0; k < 1000; ++k) {
    const double g = draw(0, 1);
    const Motion<1> own{J1(draw(-1, 1)), J1(draw(-3, 3)), J1(draw(-3, 3))};
    const Motion<1> wish{J1(draw(-1, 1)), J1(draw(-3, 3)), J1(draw(-3, 3))};
    const Motion<1> to = yielding(own, wish, g);
    const double a = K.K_p * (to.x[0] - own.x[0]) + K.K_d * (to.v[0] - own.v[0]) - K.K_f * (to.f[0] + own.f[0]);
    const double network = K.K_p * (wish.x[0] - own.x[0]) + K.K_d * wish.v[0] - K.K_f * wish.f[0];
    ASSERT_NEAR(a, g * network - K.K_d * own.v[0] - K.K_f * own.f[0], 1e-9);
  }
}

// Each of the three that hold: near at 0.9, holds at 1, lets go after its time, and only what is no longer near lets
// engage again; session time not even then, before the patient's side says so.
TEST(DoseLimits, HoldLastsUntilTheLimitIsNoLongerNear) {
  const PatientLimits p{.power_w = 1e9, .energy_j = 30, .session_s = 100, .let_go_after_s = 3};
  constexpr double kSlow = 0.1;
  DoseLimits energy(p, kSlow);
  LimitVerdict v;
  const auto run = [&](DoseLimits& limits, const LimitReadings& now, double seconds) {
    for (int k = 0; k < static_cast<int>(std::lround(seconds / kSlow)); ++k) v = limits.step(now);
  };
  run(energy, {.power_w = 1, .driven = true}, 26.9);
  EXPECT_EQ(v.warnings, 0u);
  run(energy, {.power_w = 1, .driven = true}, 0.2);
  EXPECT_EQ(v.warnings, static_cast<std::uint32_t>(kLimitEnergy));
  EXPECT_FALSE(v.hold);
  run(energy, {.power_w = 1, .driven = true}, 3.0);
  EXPECT_TRUE(v.hold);
  EXPECT_EQ(v.limits, static_cast<std::uint32_t>(kLimitEnergy));
  EXPECT_EQ(v.gain, 1.0);
  run(energy, {.driven = true}, 4.0);
  EXPECT_EQ(v.gain, 0.0);  // let go
  run(energy, {.driven = false}, 25.0);
  EXPECT_TRUE(v.hold);
  run(energy, {.driven = false}, 10.0);
  EXPECT_FALSE(v.hold);

  DoseLimits session(p, kSlow);
  run(session, {.driven = true}, 89.8);
  EXPECT_EQ(v.warnings, 0u);
  run(session, {.driven = true}, 0.4);
  EXPECT_EQ(v.warnings, static_cast<std::uint32_t>(kLimitSession));
  run(session, {.driven = true}, 10.0);
  EXPECT_TRUE(v.hold);
  run(session, {.driven = false}, 1000.0);
  EXPECT_TRUE(v.hold);
  session.begin_session();
  run(session, {.driven = false}, 0.1);
  EXPECT_FALSE(v.hold);

  DoseLimits heat({.continuous_a = 1, .overload_s = 10, .room_c = 23.2}, kSlow);
  run(heat, {.current_a = 2, .driven = true}, 10.0 - kSlow);
  EXPECT_FALSE(v.hold);
  EXPECT_EQ(v.warnings, static_cast<std::uint32_t>(kLimitHeat));
  run(heat, {.current_a = 2, .driven = true}, 2 * kSlow);
  EXPECT_TRUE(v.hold);
  run(heat, {.surface_c = 30.0, .driven = false}, 10.0);
  EXPECT_FALSE(v.hold);
  run(heat, {.surface_c = 41.5, .driven = false}, kSlow);
  EXPECT_TRUE(v.hold);  // what is measured counts, whatever the model says
}

TEST(LiveStatus, NamesWhatActsAndWhatIsNear) {
  LiveStatus status;
  EXPECT_EQ(format_live_status(status).find("patient"), std::string::npos);
  status.patient_limits = kLimitPower | kLimitHeat << kWarningShift;
  const std::string line = format_live_status(status);
  EXPECT_NE(line.find("  patient: power, heat near"), std::string::npos) << line;
}

}  // namespace
}  // namespace farhand
