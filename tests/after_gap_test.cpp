// A gap in time: what observers, laws and accounts make of ticks that were missed, of a clock that jumped, and of
// content that did not come.
#include "common/station/after_gap.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/law/mediator.hpp"
#include "common/law/two_channel_po_pc.hpp"
#include "common/runtime/owned_station.hpp"

namespace farhand {
namespace {

using J1 = Joints<1>;
constexpr double kDt = 1e-3;

TEST(AfterGap, NeitherALateTickNorALatePacketCosts) {
  AfterGap gap(kDt);
  for (int k = 0; k < 1000; ++k) {
    gap.step(k < 500 && k % 10 < 2, k > 500 && k % 7 == 0 ? 2 : 1);
    EXPECT_EQ(gap.share(), 1.0);
    EXPECT_TRUE(gap.calm());
  }
}

TEST(AfterGap, WhatTheNetworkLosesCostsNothing) {
  AfterGap gap(kDt);
  for (int k = 0; k < 3000; ++k) {
    gap.step(k % 50 != 0, 1);
    EXPECT_EQ(gap.share(), 1.0);
    EXPECT_EQ(gap.calm(), k % 50 < 4) << "meanwhile nothing is learnt of what is held";
  }
}

TEST(AfterGap, TheShareFallsAtOnceWithTheLengthOfTheGapAndComesBackInASecond) {
  for (const bool own : {true, false}) {
    double before = 1.0;
    for (const int missed : {5, 15, 30, 60}) {
      AfterGap gap(kDt);
      gap.step(false, 1);
      for (int k = 0; k < missed && !own; ++k) {
        gap.step(true, 1);
        EXPECT_EQ(gap.share(), 1.0) << "what is held on to is that of before";
      }
      gap.step(false, own ? missed + 1 : 1, own ? 0.0 : missed * kDt);
      EXPECT_LT(gap.share(), before) << missed;
      EXPECT_FALSE(gap.settled());
      before = gap.share();
      int ticks = 0;
      for (; gap.share() < 1.0 && ticks < 2000; ++ticks) gap.step(false, 1);
      EXPECT_NEAR(ticks * kDt, 1.0 - before, 2 * kDt);
    }
    EXPECT_EQ(before, 0.0);
  }
}

TEST(PeerTicks, AreMissedWhereMoreTimeThanPacketsWent) {
  PeerTicks ticks(kDt);
  const auto told = [&](std::uint32_t session, std::uint32_t seq, Nanoseconds ms) {
    Packet<1> packet;
    packet.session = session;
    packet.seq = seq;
    packet.send_time_ns = ms * kMillisecond;
    return ticks.missed_s(packet);
  };
  told(7, 1, 1000);
  EXPECT_NEAR(told(7, 2, 1001), 0.0, 1e-9);
  EXPECT_NEAR(told(7, 62, 1061), 0.0, 1e-9) << "the network lost 59";
  EXPECT_NEAR(told(7, 63, 1070), 8e-3, 1e-9);
  EXPECT_EQ(told(7, 63, 1070), 0.0) << "nothing newer";
  EXPECT_EQ(told(8, 1, 5000), 0.0) << "another session";
  EXPECT_EQ(told(8, 2, std::numeric_limits<Nanoseconds>::max() / kMillisecond), 1.0) << "a stamp that cannot be";
}

TEST(AfterGap, LearningWaits) {
  AfterGap gap(kDt);
  gap.step(false, 10);
  int rested = 0, settled = 0, calm = 0;
  for (int k = 1; k < 1000; ++k) {
    gap.step(false, 1);
    if (rested == 0 && gap.rested()) rested = k;
    if (settled == 0 && gap.settled()) settled = k;
    if (calm == 0 && gap.calm()) calm = k;
  }
  EXPECT_NEAR(rested, 20, 1);
  EXPECT_NEAR(settled, 100, 1);
  EXPECT_NEAR(calm, 500, 1);
}

TEST(AfterGap, NothingComesBackWhileNothingComes) {
  AfterGap gap(kDt);
  gap.step(false, 30);
  for (int k = 0; k < 4; ++k) gap.step(true, 1);
  const double share = gap.share();
  EXPECT_LT(share, 0.6);
  for (int k = 0; k < 80; ++k) gap.step(true, 1);
  EXPECT_EQ(gap.share(), share) << "what is held would press harder and harder";
  EXPECT_FALSE(gap.rested());
  EXPECT_NEAR(gap.silent_s(), 0.084, 1e-9);
}

// Of a drive that acts for three ticks of four.
TEST(AfterGap, KnowsHowMuchOfTheTimeADriveActed) {
  AfterGap own(kDt), peers(kDt);
  for (int k = 0; k < 20; ++k) {
    for (int tick = 0; tick < 18; ++tick) {
      EXPECT_EQ(k == 0, own.acting() == 1.0);
      own.step(false, 1);
      peers.step(false, 1);
    }
    own.step(false, 6, 0.0, true, 0.0);
    for (int tick = 0; tick < 8; ++tick) peers.step(true, 1);
    peers.step(false, 1, 8e-3);
  }
  EXPECT_NEAR(own.acting(), 0.75, 0.08);
  EXPECT_EQ(own.peers_acting(), 1.0);
  EXPECT_NEAR(peers.peers_acting(), 0.75, 0.08);
  EXPECT_EQ(peers.acting(), 1.0);
}

// The estimates of a coarse encoder: right on an average, and wrong by 0.3 N m in a tick.
TEST(LastWord, WhatIsRepeatedIsNoErrorOfOneTick) {
  Motion<1> told;
  LastWord<1> word(kDt, false), wave(kDt, true);
  const auto tick = [&](int k) {
    const double error = k % 2 == 0 ? 1.0 : -1.0;
    told = {J1(1e-3 * k), J1(0.1 + 0.5 * error), J1(-0.2 - 0.3 * error)};
    EXPECT_TRUE((word.step(told, 0.0).v == told.v).all());
    wave.step(told, 0.0);
  };
  for (int k = 0; k < 200; ++k) tick(k);
  Motion<1> repeated;
  for (int k = 1; k <= 80; ++k) {
    repeated = word.step(told, k * kDt);
    EXPECT_EQ(repeated.f[0] == told.f[0], k <= 2) << k;
  }
  EXPECT_EQ(repeated.x[0], told.x[0]);
  EXPECT_NEAR(repeated.v[0], 0.1, 0.29) << "of its last ticks an error counts for a few";
  EXPECT_NEAR(repeated.f[0], -0.2, 0.1);
  EXPECT_EQ(wave.step(told, 0.05).f[0], told.f[0]) << "a sum has no such errors";
  for (int k = 0; k < 200; ++k) word.step(told, 0.0);
  EXPECT_EQ(word.step(told, 0.05).f[0], told.f[0]) << "what was so for long is repeated to the bit";
}

TEST(HeldTo, AnOldWordNeverPressesHarder) {
  const TwoChannelParams p;
  HeldTo<1> held;
  Motion<1> master, slave;
  master.x = J1(0.02);
  const double before = held.step(p, master, slave, 0.0)[0];
  EXPECT_EQ(before, held_to(p, master, slave)[0]);
  for (int k = 1; k <= 90; ++k) {
    master.x += J1(1e-3);
    held.step(p, master, slave, k * kDt);
  }
  EXPECT_NEAR(held.value()[0], before, 6e-3 * p.K_2) << "what it was when the word became old";
  EXPECT_EQ(held.step(p, master, slave, 0.0)[0], held_to(p, master, slave)[0]);
}

StationParams params() {
  StationParams p;
  p.role = Role::kLeader;
  p.control.drive.gate.range_min = -10;
  p.control.drive.gate.range_max = 10;
  return p;
}

// On a locked rotor the reaction is the torque that acted, a low-pass later.
TEST(AfterGap, ObserversAreGivenWhatTheDriveDidMeanwhile) {
  const DriveParams p = params().control.drive;
  DirectDrive<1> drive(p);
  drive.reset({.x = J1(0.1)});
  Motion<1> local;
  const auto press = [&](int ticks) {
    local = drive.observe({.x = J1(0.1)}, ticks);
    Motion<1> target = local;
    target.x += 0.2;
    target.f = -local.f;
    drive.follow(local, target, {}, 1000);
  };
  for (int k = 0; k < 2000; ++k) press(1);
  const double pressed = drive.torque()[0];
  ASSERT_GT(pressed, 0.1);
  double f = local.f[0];
  const double a = p.g_reac.rad_s() * kDt / (1 + p.g_reac.rad_s() * kDt);
  double acted = 0;
  for (int k = 1; k <= 9; ++k) {
    const double tau = pressed * p.power_stage.share((k - 0.5) * kDt);
    acted += tau / 9;
    f += a * (tau - f);
  }
  local = drive.observe({.x = J1(0.1)}, 9);
  EXPECT_NEAR(local.f[0], f, 1e-9);
  EXPECT_NEAR(drive.acting(local)[0], acted, 1e-9);
  EXPECT_NEAR(drive.acted_share(), acted / pressed, 1e-9);
  EXPECT_EQ(drive.torque()[0], 0.0) << "the drive has let go";
}

// What a station makes of an axis that moves evenly while its clock does something else.
struct Even {
  OwnedStation<DirectIo<1>> station{params()};
  Nanoseconds now = kSecond;
  double x = 0;
  static constexpr double kSpeed = 0.5;
  void tick(Nanoseconds on, int ticks = 1) {
    now += on;
    x += kSpeed * kDt;
    DirectDrive<1>::Sensed sensed;
    sensed.x = J1(x);
    station.tick(now, sensed, OperatorAct::kNone, ticks);
  }
  double v() const { return station.trace().local.v[0]; }
};

TEST(AfterGap, AClockThatJumpsIsAGapAndNoSpeed) {
  for (const Nanoseconds jump : {20 * kMillisecond, 5 * kSecond, -kSecond}) {
    Even even;
    for (int k = 0; k < 300; ++k) even.tick(kMillisecond);
    ASSERT_NEAR(even.v(), Even::kSpeed, 1e-9);
    even.tick(jump);
    for (int k = 0; k < 300; ++k) {
      EXPECT_GE(even.v(), 0.0) << jump;
      EXPECT_LE(even.v(), Even::kSpeed + 1e-9) << jump;
      even.tick(kMillisecond);
    }
    EXPECT_NEAR(even.v(), Even::kSpeed, 1e-6) << jump;
  }
}

TEST(AfterGap, AReadingAfterALongGapIsAStartAtRest) {
  DirectDrive<1> drive(params().control.drive);
  drive.reset({.x = J1(0)});
  for (int k = 1; k < 100; ++k) drive.observe({.x = J1(1e-3 * k)}, 1);
  const Motion<1> local = drive.observe({.x = J1(0.5)}, 1'000'000);
  EXPECT_EQ(local.v[0], 0.0);
  EXPECT_EQ(local.f[0], 0.0);
}

TEST(AfterGap, AMediatorLearnsNothingAcrossIt) {
  const FourChannelGains K{.K_p = 400, .K_d = 40, .K_f = 250};
  Mediator<1> mediator(K, kDt);
  Motion<1> still;
  mediator.reset(still);
  // A wall and friction could be read from this.
  for (int k = 0; k < 3000; ++k) {
    Motion<1> slave;
    slave.x = J1(0.1 * std::sin(0.01 * k));
    slave.f = J1(std::copysign(0.2, std::cos(0.01 * k)) + 5 * slave.x[0]);
    EXPECT_EQ(mediator.step(slave, slave, Learns::kNothing, false).f[0], 0.0);
  }
  EXPECT_EQ(mediator.friction(), 0.0);
}

// A moment after a gap no spring is learnt, but where it begins: so that what the slave feels now is felt.
TEST(AfterGap, AMediatorGoesOnToLearnWhereAContactBegins) {
  const FourChannelGains K{.K_p = 400, .K_d = 40, .K_f = 250};
  Motion<1> slave;
  slave.x = J1(0.1);
  slave.f = J1(0.3);
  const auto felt = [&](Learns learns) {
    Mediator<1> mediator(K, kDt);
    mediator.reset(slave);
    Motion<1> master = slave;
    master.f = J1(-0.3);
    double f = 0;
    for (int k = 0; k < 3000; ++k) f = mediator.step(master, slave, learns, false).f[0];
    return f;
  };
  EXPECT_EQ(felt(Learns::kNothing), 0.0);
  EXPECT_NEAR(felt(Learns::kWhere), 0.3, 0.01);
}

TEST(AfterGap, AnAccountOfEnergyCountsTheTorqueThatActed) {
  const FourChannelGains K;
  const auto margin = [&](double acted) {
    PassiveSlave<1> slave(LawParams{}, K, kDt);
    LawInputs<1> in;
    in.engaged = true;
    in.received.f = J1(-0.5);
    slave.start(in);
    slave.step(in);
    in.since.ticks = 9;
    in.account = {.torque = J1(0.5), .acted = acted, .moved = J1(0.1), .received = 0.0, .engaged = true};
    slave.step(in);
    return slave.signals().own[1];
  };
  EXPECT_LT(margin(1.0), 0.0);
  EXPECT_NEAR(margin(0.25), 0.25 * margin(1.0), 1e-12);
}

}  // namespace
}  // namespace farhand
