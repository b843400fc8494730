// Stations in pairs, with an axis under each and delay between them: what they do when something goes wrong, and that
// nothing jumps when they take hold, let go or lose each other.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/law/acceleration_law.hpp"
#include "netem/lab/unexplained_step.hpp"
#include "tests/support/station_pair.hpp"

namespace farhand {
namespace {

TEST(Station, TwoOfThemShareTheirAngles) {
  Pair pair;
  pair.slave.axis.stiffness = 0;
  pair.slave.axis.x.setConstant(0.08);
  pair.engage();
  pair.master.axis.rest.setConstant(-0.15);
  pair.run(5000);
  EXPECT_LT((pair.slave.axis.x - pair.master.axis.x).abs().maxCoeff(), 1e-3);
  EXPECT_LT((pair.slave.axis.x - pair.master.axis.rest).abs().maxCoeff(), 5e-3);
}

TEST(Station, AReadingThatIsNoNumberCutsTheTorqueAtOnceAndForGood) {
  for (const double wrong : {kNan, kInf, -kInf}) {
    for (const bool on_master : {true, false}) {
      Pair pair;
      pair.slave.axis.stiffness = 5;
      pair.engage();
      pair.master.axis.rest.setConstant(0.2);
      pair.run(1000);
      const auto fails = [&](auto& side, auto& peer) {
        ASSERT_GT(side.axis.torque.abs().maxCoeff(), 0.01);
        side.fault.x[0] = wrong;
        pair.tick();
        EXPECT_EQ(side.state(), S::kFault);
        EXPECT_EQ(side.trace().reason, Reason::kNotFinite);
        EXPECT_TRUE(side.trace().limits & kLimitNotFinite);
        EXPECT_TRUE((side.axis.torque == 0.0).all());
        side.fault.x.setZero();  // a good reading does not make up for it, nor does the operator's wish to go on
        for (int k = 0; k < 1000; ++k) {
          pair.act = k == 500 ? OperatorAct::kEngage : OperatorAct::kNone;
          pair.tick();
          ASSERT_EQ(side.state(), S::kFault);
          ASSERT_TRUE((side.axis.torque == 0.0).all());
        }
        EXPECT_EQ(peer.state(), S::kHolding);
        EXPECT_EQ(peer.trace().reason, Reason::kPeerFault);
      };
      if (on_master) {
        fails(pair.master, pair.slave);
        pair.act = OperatorAct::kReset;
        pair.run(1);
        EXPECT_EQ(pair.master.state(), S::kSelfTest);
        pair.run(20);
        EXPECT_EQ(pair.master.state(), S::kReady);
        pair.engage();
      } else {
        fails(pair.slave, pair.master);
      }
    }
  }
}

TEST(Station, AReferenceDriveLetsGoOnAReadingThatIsNoNumber) {
  OwnedStation<ReferenceIo<1>> station(Side<DirectIo<1>>::params(Role::kFollower, 2));
  ReferenceDrive<1>::Sensed sensed{.x = Joints<1>(0.1), .f = Joints<1>(0.0), .valid = true};
  Packet<1> leader;
  leader.session = 1;
  leader.motion.x[0] = 0.1;
  Nanoseconds now = 0;
  const auto tick = [&](S state) {
    now += kMillisecond;
    leader.send_time_ns = now;
    ++leader.seq;
    leader.state = state;
    station.receive(leader, now);
    return station.tick(now, sensed);
  };
  for (int k = 0; k < 1100; ++k) EXPECT_FALSE(tick(S::kAligning).command.track);
  for (int k = 0; k < 50; ++k) EXPECT_TRUE(tick(S::kEngaged).command.track);
  sensed.f[0] = kNan;
  const auto out = tick(S::kEngaged);
  EXPECT_FALSE(out.command.track);
  EXPECT_TRUE(out.command.reference.finite());
  EXPECT_TRUE(out.packet.motion.finite());
  EXPECT_EQ(station.state(), S::kFault);
  sensed.f[0] = 0.0;
  for (int k = 0; k < 100; ++k) EXPECT_FALSE(tick(S::kEngaged).command.track);
}

// Whatever the operator and the network do, the motion to follow goes on where it was. At the tick of a change of state
// it is exactly the one before. Between changes it moves by no more than what it is made of: the own angle, the peer's,
// the compensation (scaled by at most 1), and the fading difference, whose smoothstep is at most 1.5 times as steep as
// the speed of alignment. The torque moves by what the law makes of that.
struct Continuity {
  StationParams params;
  TickTrace<1> last{};
  Joints<1> torque = Joints<1>::Zero();
  bool begun = false;
  int changes = 0;
  double left = 0;  // rad, of the old motion on coming to rest
  double largest_step = 0, largest_torque_step_at_change = 0;

  void see(const TickTrace<1>& now, const Joints<1>& tau) {
    if (asks_of(now.state) == Asks::kNothing) {
      ASSERT_EQ(tau[0], 0.0) << name_of(now.state);  // at once, from whatever it was
      changes += begun && now.state != last.state;
    } else if (begun) {
      const Joints<1> dx = (now.target.x - last.target.x).abs();
      const Joints<1> own = (now.local.x - last.local.x).abs();
      if (now.state != last.state) {
        ++changes;
        left = now.state == S::kHolding ? (now.target.x - now.local.x).abs().maxCoeff() : 0.0;
        ASSERT_LE(dx.maxCoeff(), 1e-9);
        ASSERT_LE((now.target.v - last.target.v).abs().maxCoeff(), 1e-9);
        ASSERT_LE((now.target.f - last.target.f).abs().maxCoeff(), 1e-9);
        largest_torque_step_at_change = std::max(largest_torque_step_at_change, (tau - torque).abs().maxCoeff());
      } else {
        double explained = own.maxCoeff() + (now.remote.x - last.remote.x).abs().maxCoeff() +
                           1.5 * std::max(params.align_speed, left / params.blend_s) * params.control.drive.dt_s;
        if (now.state == S::kEngaged) {
          explained += std::abs(now.law.x_cdob - last.law.x_cdob) +
                       std::abs(now.law.alpha - last.law.alpha) * std::abs(now.law.x_cdob);
        }
        ASSERT_LE(dx.maxCoeff(), explained + 1e-9) << name_of(now.state);
      }
      largest_step = std::max(largest_step, dx.maxCoeff());
      // J_n (C_p, K_f) of what changed, the observer's share, the part of the law's torque that is handed over per
      // tick, the part of what the network asks that the patient's soft start is, and what a gap takes of it.
      const FourChannelGains& K = params.control.drive.K;
      const AxisModel& model = params.control.drive.model;
      const auto change = [](const Joints<1>& a, const Joints<1>& b) { return (a - b).abs().maxCoeff(); };
      const double d_x = change(now.target.x, last.target.x) + own.maxCoeff();
      const double d_v = change(now.target.v, last.target.v) + change(now.local.v, last.local.v);
      const double d_f = change(now.target.f, last.target.f) + change(now.local.f, last.local.f);
      const double wish =
          (model.J_n * four_channel(K, now.local, now.target) + now.local.f).abs().maxCoeff() + model.viscous;
      const double asked =
          (K.K_p * (now.target.x - now.local.x).abs() + K.K_d * now.target.v.abs() + K.K_f * now.target.f.abs())
              .maxCoeff();
      const double taken = std::abs(now.share - last.share);  // by a gap of the network, or given back
      const double explained = model.J_n * (K.K_p * d_x + K.K_d * d_v + K.K_f * d_f) +
                               change(now.local.f, last.local.f) + model.viscous * change(now.local.v, last.local.v) +
                               (params.control.drive.dt_s / 0.2) * wish +
                               (params.control.drive.dt_s / params.guard.limits.soft_start_s) * model.J_n * asked +
                               taken * model.J_n * (asked + K.K_d * now.local.v.abs().maxCoeff());
      ASSERT_LE((tau - torque).abs().maxCoeff(), explained + 1e-9) << name_of(last.state) << name_of(now.state);
    }
    begun = true;
    last = now;
    torque = tau;
  }
};

TEST(Station, NothingJumpsWhateverTheOperatorAndTheNetworkDo) {
  std::mt19937_64 random(11);
  const auto uniform = [&](double a, double b) {
    return a + (b - a) * (static_cast<double>(random() >> 11) * 0x1p-53);
  };
  int changes = 0, engagements = 0;
  double at_change = 0;
  for (int round = 0; round < 12; ++round) {
    Pair pair;
    pair.delay = static_cast<Nanoseconds>(uniform(0, 150)) * kMillisecond;
    pair.slave.axis.stiffness = uniform(0.2, 5);
    pair.slave.axis.rest[0] = pair.slave.axis.x[0] = uniform(-0.2, 0.2);
    Continuity master{.params = pair.master.own}, slave{.params = pair.slave.own};
    for (int k = 0; k < 20'000; ++k) {
      const std::uint64_t dice = random() % 6000;
      if (dice < 10) pair.act = OperatorAct::kEngage;
      if (dice == 10) pair.act = OperatorAct::kHold;
      if (dice == 11) pair.act = OperatorAct::kStop;
      if (dice >= 40 && dice < 50) pair.act = OperatorAct::kReset;
      if (dice == 12) pair.forward = !pair.forward;
      if (dice == 13) pair.backward = !pair.backward;
      if (dice >= 20 && dice < 30) pair.forward = pair.backward = true;
      if (dice == 31) pair.master.axis.rest[0] = uniform(-0.3, 0.3);
      pair.tick();
      engagements += pair.slave.state() == S::kEngaged && slave.last.state != S::kEngaged;
      ASSERT_NO_FATAL_FAILURE(master.see(pair.master.trace(), pair.master.axis.torque)) << round << ' ' << k;
      ASSERT_NO_FATAL_FAILURE(slave.see(pair.slave.trace(), pair.slave.axis.torque)) << round << ' ' << k;
    }
    changes += master.changes + slave.changes;
    at_change = std::max({at_change, master.largest_torque_step_at_change, slave.largest_torque_step_at_change});
  }
  std::printf("%d changes of state, %d engagements, largest torque step at a change %.3g N m\n", changes, engagements,
              at_change);
  EXPECT_GT(changes, 200);
  EXPECT_GT(engagements, 30);
}

// The hand moves at 0.45 rad/s while the leader aligns, and nothing is heard of it for up to 60 ms: held, it is easier
// to come close to, so that the leader engages on what is shown of it, and the next packet shows it 20 mrad further.
TEST(Station, AGapOfTheNetworkThatEndsAsTheLeaderEngagesIsNoJump) {
  double largest = 0;
  int engaged_on_held = 0;
  for (int gap_ms = 5; gap_ms <= 60; gap_ms += 5) {
    for (int begin_ms = 2030; begin_ms < 2110; ++begin_ms) {
      Pair pair;
      pair.slave.axis.stiffness = 5;
      double last_remote = 0;
      for (int k = 0; k < 2400; ++k) {
        if (k == 1100) pair.act = OperatorAct::kEngage;
        pair.slave.axis.rest[0] = 0.3 * std::sin(1.5e-3 * k);
        pair.backward = k < begin_ms || k >= begin_ms + gap_ms;
        const TickTrace<1> before = pair.master.trace();
        pair.tick();
        const TickTrace<1>& now = pair.master.trace();
        engaged_on_held += before.state == S::kAligning && now.state == S::kEngaged && now.remote.x[0] == last_remote;
        last_remote = now.remote.x[0];
        if (before.state != S::kAligning && before.state != S::kEngaged) continue;
        if (pair.master.state() == S::kEngaged && k > begin_ms + gap_ms + 100) break;
        largest = std::max(largest,
                           unexplained_step(now.target.x[0] - before.target.x[0], 1e-3,
                                            {before.local.v[0], now.local.v[0], before.remote.v[0], now.remote.v[0]}));
      }
    }
  }
  std::printf("engaged %d times on a held motion, largest step %.3f mrad\n", engaged_on_held, 1e3 * largest);
  EXPECT_GT(engaged_on_held, 10);
  EXPECT_LE(largest, 1e-3);
}

TEST(Station, AStreamThatResumesDoesNotTakeTheHandAgain) {
  Pair pair;
  pair.engage();
  Packet<1> stale;
  stale.session = 1;
  stale.seq = 1'000'000;
  stale.state = S::kEngaged;
  pair.forward = false;
  pair.run(200);
  ASSERT_EQ(pair.slave.state(), S::kHolding);
  EXPECT_EQ(pair.slave.trace().reason, Reason::kPeerSilent);
  for (int k = 0; k < 3000; ++k) {  // as if the leader had never stopped
    ++stale.seq;
    stale.send_time_ns = pair.now;
    pair.slave.inbox.emplace_back(pair.now, stale);
    pair.tick();
    ASSERT_EQ(pair.slave.state(), S::kHolding);
  }
}

// The encoder is not differentiated across a gap: a hand at constant speed keeps its speed.
TEST(Station, MissedTicksMakeNoSpike) {
  for (const double speed : {0.5, -0.5}) {
    for (const int missed : {2, 5, 30}) {
      OwnedStation<DirectIo<1>> station(Side<DirectIo<1>>::params(Role::kLeader, 1));
      Nanoseconds now = 0;
      const auto at = [&](int ticks) {
        now += ticks * kMillisecond;
        DirectDrive<1>::Sensed sensed;
        sensed.x = Joints<1>(speed * to_seconds(now));
        station.tick(now, sensed, OperatorAct::kNone, ticks);
        return station.trace().local;
      };
      for (int k = 0; k < 200; ++k) at(1);
      const Motion<1> before = station.trace().local;
      ASSERT_NEAR(before.v[0], speed, 1e-9);
      for (const int ticks : {missed, 1, 1, 1, missed, 1}) {
        const Motion<1> after = at(ticks);
        EXPECT_NEAR(after.v[0], speed, 1e-9) << missed;
        EXPECT_NEAR(after.f[0], before.f[0], 1e-9) << missed;
      }
    }
  }
}

TEST(Station, SurvivesMissedTicksWhileEngaged) {
  Pair pair;
  pair.slave.axis.stiffness = 0;  // in contact the compensation leaves an offset
  pair.engage();
  pair.master.axis.rest[0] = 0.2;
  pair.run(100);
  const double v = pair.slave.trace().local.v[0];
  const double x = pair.slave.axis.x[0];
  ASSERT_GT(std::abs(v), 0.2);
  // The slave's machine stalls for 30 ms; its motor holds the last torque, against its contract.
  pair.now += 30 * kMillisecond;
  pair.slave.axis.advance(30);
  pair.slave.tick(pair.now, OperatorAct::kNone, 30);
  EXPECT_EQ(pair.slave.state(), S::kEngaged);
  EXPECT_NEAR(pair.slave.trace().local.v[0], (pair.slave.axis.x[0] - x) / 0.03, 1e-3);
  pair.run(3000);
  EXPECT_LT(std::abs(pair.slave.axis.x[0] - pair.master.axis.x[0]), 5e-3);
}

TEST(Station, APeerThatRestartsIsANewPeer) {
  for (const bool restart_master : {true, false}) {
    Pair pair;
    pair.engage();
    pair.master.axis.rest[0] = 0.1;
    pair.run(1000);
    Continuity master{.params = pair.master.own}, slave{.params = pair.slave.own};
    if (restart_master) {
      pair.master.restart(77);
      pair.master.inbox.clear();
    } else {
      pair.slave.restart(78);
      pair.slave.inbox.clear();
    }
    for (int k = 0; k < 1000; ++k) {
      pair.tick();
      if (restart_master) {
        ASSERT_NO_FATAL_FAILURE(slave.see(pair.slave.trace(), pair.slave.axis.torque));
      } else {
        ASSERT_NO_FATAL_FAILURE(master.see(pair.master.trace(), pair.master.axis.torque));
      }
    }
    EXPECT_EQ(pair.master.state(), restart_master ? S::kReady : S::kHolding);
    EXPECT_EQ(pair.slave.state(), S::kReady);  // a leader that is Ready lets the hand go
    EXPECT_EQ(restart_master ? pair.slave.trace().reason : pair.master.trace().reason, Reason::kPeerLetGo);
    pair.engage();
  }
}

TEST(Station, HoldAndStopReachBothSides) {
  Pair pair;
  pair.engage();
  pair.act = OperatorAct::kHold;
  pair.run(100);
  EXPECT_EQ(pair.master.state(), S::kHolding);
  EXPECT_EQ(pair.slave.state(), S::kHolding);
  EXPECT_EQ(pair.master.trace().reason, Reason::kOperator);
  EXPECT_EQ(pair.slave.trace().reason, Reason::kPeerLetGo);
  pair.engage();
  pair.act = OperatorAct::kStop;
  pair.run(1);
  EXPECT_EQ(pair.master.state(), S::kStopped);
  EXPECT_EQ(pair.master.axis.torque[0], 0.0);
  pair.run(300);  // the other lets go within 0.2 s; without gravity nothing is left
  EXPECT_EQ(pair.slave.state(), S::kReady);
  EXPECT_EQ(pair.slave.trace().reason, Reason::kPeerStopped);
  EXPECT_EQ(pair.slave.axis.torque[0], 0.0);
  pair.act = OperatorAct::kEngage;
  pair.run(300);
  EXPECT_EQ(pair.master.state(), S::kStopped);
  pair.act = OperatorAct::kReset;
  pair.engage();
}

TEST(Station, WhatThePatientStoppedTheTherapistCannotStart) {
  Pair pair;
  pair.engage();
  pair.slave_act = OperatorAct::kStop;
  pair.run(1);
  EXPECT_EQ(pair.slave.state(), S::kStopped);
  EXPECT_EQ(pair.slave.axis.torque[0], 0.0);
  pair.run(100);
  EXPECT_EQ(pair.master.state(), S::kHolding);
  EXPECT_EQ(pair.master.trace().reason, Reason::kPeerStopped);
  const OperatorAct acts[] = {OperatorAct::kEngage, OperatorAct::kStop, OperatorAct::kReset, OperatorAct::kEngage};
  for (const OperatorAct act : acts) {
    pair.act = act;
    for (int k = 0; k < 1000; ++k) {
      pair.tick();
      ASSERT_EQ(pair.slave.state(), S::kStopped);
      ASSERT_EQ(pair.slave.axis.torque[0], 0.0);
    }
  }
  pair.slave_act = OperatorAct::kReset;
  pair.engage();
}

TEST(Station, ADeviceThatIsLostIsTestedOnceItIsBack) {
  Pair pair;
  pair.engage();
  pair.slave.connected = false;
  pair.run(1);
  EXPECT_EQ(pair.slave.state(), S::kOff);
  EXPECT_EQ(pair.slave.trace().reason, Reason::kDeviceLost);
  EXPECT_EQ(pair.slave.axis.torque[0], 0.0);
  pair.run(100);
  EXPECT_EQ(pair.master.state(), S::kHolding);
  pair.slave.axis.x[0] += 0.05;  // moved by hand meanwhile
  pair.slave.axis.rest = pair.slave.axis.x;
  pair.slave.axis.v.setZero();
  pair.slave.connected = true;
  for (int k = 0; k < 500; ++k) {
    pair.tick();
    ASSERT_EQ(pair.slave.state(), k < 20 ? S::kSelfTest : S::kReady);
    ASSERT_LT(std::abs(pair.slave.trace().local.v[0]), 0.01);
    ASSERT_EQ(pair.slave.axis.torque[0], 0.0);
  }
  pair.engage();
}

}  // namespace
}  // namespace farhand
