// What no station may ever do, whatever it meets; that a patient can pull away; and how an axis finds its zero.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

#include "tests/support/station_pair.hpp"

namespace farhand {
namespace {

// What may never be seen of a station, whatever it meets.
template <class Io>
struct Unsafe {
  static constexpr bool kDirect = Side<Io>::kDirect;
  S last = S::kOff;
  Joints<1> target = Joints<1>::Zero(), x = Joints<1>::Zero();
  typename Io::Command command;
  int ready_ticks = 0;
  double largest_step = 0;  // of what is asked for, on engaging
  std::set<S> seen;

  void see(const Side<Io>& side, OperatorAct act) {
    const TickTrace<1>& trace = side.trace();
    const S now = trace.state;
    seen.insert(now);
    if (now != last) {
      const auto rows = Engagement::transitions();
      ASSERT_TRUE(std::any_of(rows.begin(), rows.end(),
                              [&](const Transition& row) { return row.from.has(last) && row.to == now; }))
          << name_of(last) << " to " << name_of(now);
      if (last == S::kFault || last == S::kStopped) {
        ASSERT_TRUE(act == OperatorAct::kReset || now == S::kFault);
      }
    }
    ready_ticks = now == S::kReady ? ready_ticks + 1 : 0;
    const bool gives_nothing = asks_of(now) == Asks::kNothing || ready_ticks > 201;
    if constexpr (kDirect) {
      ASSERT_TRUE(std::isfinite(side.command.torque[0]));
      if (gives_nothing) {
        ASSERT_EQ(side.command.torque[0], 0.0) << name_of(now);
      }
      if (now == S::kHoming) {
        ASSERT_LE(std::abs(side.command.torque[0]), 2 * side.own.homing.torque + 1e-12);
      }
      if (now == S::kIdentifying) {
        ASSERT_LE(std::abs(side.command.torque[0]), side.own.identifying.torque + 1e-12);
      }
    } else {
      ASSERT_TRUE(side.command.reference.finite());
      ASSERT_EQ(side.command.track, asks_of(now) == Asks::kMotion) << name_of(now);
    }
    if (now == S::kEngaged && last != now) {
      double step = std::abs(trace.target.x[0] - target[0]);
      if constexpr (!kDirect) {
        const double before = command.track ? command.reference.x[0] : side.axis.x[0];
        step = std::max(step, std::abs(side.command.reference.x[0] - before));
      }
      ASSERT_LE(step, 1e-3);
      largest_step = std::max(largest_step, step);
    }
    last = now;
    target = trace.target.x;
    command = side.command;
  }
};

// A million ticks of each kind of pair. Every few hundred ticks something happens: acts on either side, a link that
// carries nothing or lies about the states, devices that are pulled, show nonsense or do not come to rest.
template <class Io>
void expect_nothing_unsafe(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto uniform = [&](double a, double b) {
    return a + (b - a) * (static_cast<double>(random() >> 11) * 0x1p-53);
  };
  int engagements = 0;
  double largest_step = 0;
  std::set<S> seen[2];
  for (int round = 0; round < 20; ++round) {
    PairOn<Io> pair;
    const bool homing = round % 4 == 3, identification = round % 4 == 1;
    if (homing || identification) {
      for (StationParams* own : {&pair.master.own, &pair.slave.own}) {
        own->engagement.homing = homing;
        own->engagement.identification = identification;
        own->identifying = {.sweeps = {.low = -0.2, .high = 0.2, .rounds = 1}, .torque = 0.1};
        own->homing = {.stop = 0.2, .back = 0.0, .speed = 0.5, .torque = 0.1};
      }
      pair.master.restart(1);
      pair.slave.restart(2);
    }
    pair.delay = static_cast<Nanoseconds>(uniform(0, 80)) * kMillisecond;
    pair.slave.axis.stiffness = uniform(0.2, 5);
    pair.slave.axis.rest[0] = pair.slave.axis.x[0] = uniform(-0.2, 0.2);
    Unsafe<Io> master;
    Unsafe<Io> slave;
    const auto fail = [&](auto& side) {
      switch (random() % 5) {
        case 0:
          side.connected = false;
          break;
        case 1:
          side.fault.x[0] = kNan;
          break;
        case 2:
          side.fault.x[0] = 5.0;
          break;
        case 3:
          if constexpr (requires { side.fault.at_rest; }) side.fault.at_rest = false;
          break;
        default:
          side.connected = true;
          side.fault = {};
      }
    };
    for (int k = 0; k < 80'000; ++k) {
      const std::uint64_t dice = random() % 8000;
      const OperatorAct led = identification ? OperatorAct::kIdentify : OperatorAct::kHome;
      if (dice < 40) pair.act = dice < 20 ? OperatorAct::kEngage : dice < 30 ? OperatorAct::kReset : led;
      if (dice >= 40 && dice < 60) pair.slave_act = dice < 50 ? OperatorAct::kReset : led;
      if (dice == 60) pair.act = static_cast<OperatorAct>(random() % 8);
      if (dice == 61) pair.slave_act = static_cast<OperatorAct>(random() % 8);
      if (dice == 62) pair.forward = false;
      if (dice == 63) pair.backward = false;
      if (dice == 64) pair.lie = static_cast<S>(random() % 11);
      if (dice == 65) fail(pair.master);
      if (dice == 66) fail(pair.slave);
      if (dice == 67) pair.master.axis.rest[0] = uniform(-0.3, 0.3);
      if (dice >= 70 && dice < 80) pair.forward = pair.backward = true;
      if (dice >= 75 && dice < 80) pair.lie.reset();
      if (dice >= 80 && dice < 90) {
        pair.master.connected = pair.slave.connected = true;
        pair.master.fault = pair.slave.fault = {};
      }
      const OperatorAct act = pair.act, slave_act = pair.slave_act;
      pair.tick();
      engagements += pair.slave.state() == S::kEngaged && slave.last != S::kEngaged;
      ASSERT_NO_FATAL_FAILURE(master.see(pair.master, act)) << "master, " << round << ' ' << k;
      ASSERT_NO_FATAL_FAILURE(slave.see(pair.slave, slave_act)) << "slave, " << round << ' ' << k;
    }
    largest_step = std::max({largest_step, master.largest_step, slave.largest_step});
    seen[0].merge(master.seen);
    seen[1].merge(slave.seen);
  }
  std::printf("%d engagements of the slave, largest step on engaging %.2g mrad\n", engagements, 1e3 * largest_step);
  EXPECT_GT(engagements, 100);
  const std::size_t states = DriveOn<Io>::kGivesTorque ? 10 : 9;  // behind an MCU nothing is identified
  EXPECT_EQ(seen[0].size(), states);
  EXPECT_EQ(seen[1].size(), states - 1);  // the follower never aligns
}

TEST(Station, NothingUnsafeWhateverHappens) {
  expect_nothing_unsafe<DirectIo<1>>(21);
  expect_nothing_unsafe<ReferenceIo<1>>(22);
}

// A hand that takes the device 10 degrees away from where it holds: the spring of K_p/K_f asks for no more than
// 0.28 N m, with the velocity that it is pulled at, K_d/K_f v besides.
TEST(Station, APatientPullsAwayFromHoldingAgainstAFractionOfANewtonMetre) {
  Pair pair;
  pair.slave.axis.stiffness = 200;  // a hand that goes where it wants
  pair.engage();
  pair.forward = pair.backward = false;
  pair.run(700);
  ASSERT_EQ(pair.slave.state(), S::kHolding);
  EXPECT_NEAR(pair.slave.trace().target.v[0], 0.0, 1e-12) << "what moved has come to rest";
  const FourChannelGains& K = pair.slave.own.control.drive.K;
  const double start = pair.slave.axis.x[0], speed = 0.35, away = 10 * 0.0174533;
  double largest = 0;
  for (int k = 0; k < 3000; ++k) {
    pair.slave.axis.rest[0] = start + std::min(speed * 1e-3 * k, away);
    pair.tick();
    largest = std::max(largest, std::abs(pair.slave.axis.torque[0]));
  }
  ASSERT_EQ(pair.slave.state(), S::kHolding);
  EXPECT_NEAR(pair.slave.axis.x[0], start + away, 2e-3);
  const double steady = std::abs(pair.slave.axis.torque[0]), spring = K.K_p / K.K_f * away;
  std::printf("10 degrees away: %.3f N m at rest, %.3f N m on the way\n", steady, largest);
  EXPECT_LE(steady, 1.02 * spring);
  EXPECT_LE(largest, spring + 1.2 * K.K_d / K.K_f * speed);
}

// An encoder that counts from where it was switched on, and a stop at 0.3 rad.
struct Lost {
  explicit Lost(double start) {
    StationParams p = Side<DirectIo<1>>::params(Role::kFollower, 2);
    p.engagement.homing = true;
    p.engagement.homing_timeout = 15 * kSecond;
    p.homing = {.stop = 0.3, .back = -0.1, .speed = 0.2, .torque = 0.15};
    station.emplace(p);
    counted_from = x = start;
  }
  double counted_from, x, v = 0, torque = 0, stop_min = -0.3, largest = 0, fastest = 0;
  double stop_max = 0.3;
  bool connected = true;
  std::optional<OwnedStation<DirectIo<1>>> station;
  Nanoseconds now = 0;

  void run(int ticks, OperatorAct act = OperatorAct::kNone) {
    for (int k = 0; k < ticks; ++k) {
      now += kMillisecond;
      for (int i = 0; i < 50; ++i) {
        const double stop = 3000 * (std::max(x - stop_max, 0.0) + std::min(x - stop_min, 0.0));
        const double damping = stop != 0 ? 3.0 : 0.005;
        v += 2e-5 * (torque - stop - damping * v) / 4e-3;
        x += 2e-5 * v;
      }
      DirectDrive<1>::Sensed sensed;
      sensed.x[0] = x - counted_from;
      sensed.valid = connected;
      torque = station->tick(now, sensed, k == 0 ? act : OperatorAct::kNone).command.torque[0];
      if (station->state() == S::kHoming) {
        largest = std::max(largest, std::abs(torque));
        fastest = std::max(fastest, std::abs(v));
      }
    }
  }
};

TEST(Station, HomingFindsTheZeroSlowlyAndSoftlyFromAnywhere) {
  for (const double start : {-0.29, -0.1, 0.0, 0.15, 0.3}) {
    Lost lost(start);
    lost.run(2000);
    ASSERT_EQ(lost.station->state(), S::kSelfTest) << "it waits for `home`";
    ASSERT_EQ(lost.torque, 0.0);
    lost.run(9000, OperatorAct::kHome);
    ASSERT_EQ(lost.station->state(), S::kReady) << name_of(lost.station->trace().reason);
    EXPECT_EQ(lost.station->trace().reason, Reason::kHomed);
    EXPECT_NEAR(lost.station->trace().local.x[0], lost.x, 2e-3) << "what it believes is so";
    EXPECT_NEAR(lost.x, -0.1, 0.0175 + 2e-3);
    EXPECT_LE(lost.largest, 0.3 + 1e-12);
    EXPECT_LE(lost.fastest, 0.4);
    std::printf("from %5.2f rad: wrong by %.2g mrad, at most %.3f N m and %.2f rad/s\n", start,
                1e3 * (lost.station->trace().local.x[0] - lost.x), lost.largest, lost.fastest);
  }
}

TEST(Station, HomingEndsInAFaultThatSaysWhy) {
  const auto ends = [](auto&& disturb, Reason reason) {
    Lost lost(0.0);
    lost.run(100);
    lost.run(500, OperatorAct::kHome);
    ASSERT_EQ(lost.station->state(), S::kHoming);
    disturb(lost);
    EXPECT_EQ(lost.station->state(), S::kFault);
    EXPECT_EQ(lost.station->trace().reason, reason);
    EXPECT_EQ(lost.torque, 0.0);
    lost.connected = true;
    lost.run(100, OperatorAct::kReset);
    EXPECT_EQ(lost.station->state(), S::kSelfTest) << "its angle is still not known";
  };
  ends([](Lost& lost) { lost.run(1, OperatorAct::kHold); }, Reason::kOperator);
  ends(
      [](Lost& lost) {
        lost.connected = false;
        lost.run(1);
      },
      Reason::kDeviceLost);
  ends(
      [](Lost& lost) {
        lost.stop_max = 1e9;
        lost.run(16'000);
      },
      Reason::kTimeout);
  ends(
      [](Lost& lost) {  // something is in the way back
        lost.run(2500);
        lost.stop_min = lost.x - 0.02;
        lost.run(8000);
      },
      Reason::kBlocked);
}

}  // namespace
}  // namespace farhand
