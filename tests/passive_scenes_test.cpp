// Energy tanks, and passivity observers and controllers: what they may give, and whole sessions over delays.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <string>
#include <vector>

#include "common/judge/metrics.hpp"
#include "common/law/four_channel_tank.hpp"
#include "common/law/two_channel_po_pc.hpp"
#include "common/link/codec.hpp"
#include "netem/lab/simulation.hpp"
#include "tests/support/contact_cell.hpp"

namespace farhand {
namespace {

constexpr double kTick = 1e-3, kDamper = 0.4;

// Two tanks over a line that loses packets and delays them: together they never give more than they were given and
// lent.
TEST(EnergyTank, TheTwoGiveNoMoreThanTheyWereGivenAndLent) {
  const TankParams p;
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int run = 0; run < 50; ++run) {
    EnergyTank a(p, kDamper, kTick), b(p, kDamper, kTick);
    const int delay = static_cast<int>(300 * unit(random));
    std::vector<double> from_a(1, 0.0), from_b(1, 0.0);
    double heard_a = 0, heard_b = 0, given = 0;
    for (int k = 0; k < 3000; ++k) {
      const auto hear = [&](double& heard, const std::vector<double>& sent) {
        if (k >= delay && unit(random) > 0.3) heard = sent[static_cast<std::size_t>(k - delay)];
      };
      hear(heard_a, from_b);
      hear(heard_b, from_a);
      // The law wants to give all the time; each gets its share of that.
      const double to_a = a.share() * 2e-4 * (unit(random) - 0.2), to_b = b.share() * 2e-4 * (unit(random) - 0.2);
      a.step(to_a, heard_a, 1);
      b.step(to_b, heard_b, 1);
      from_a.push_back(a.sent());
      from_b.push_back(b.sent());
      given += to_a + to_b;
      const double on_its_way = (a.sent() - heard_b) + (b.sent() - heard_a);
      ASSERT_NEAR(a.level() + b.level() + on_its_way, 2 * p.level - given, 1e-9);
      ASSERT_LE(given, 2 * p.level + 2e-4);
    }
    EXPECT_LT(a.share(), 0.2) << "the test has emptied it";
  }
}

TEST(EnergyTank, LentItIsFullAndItsLineToo) {
  const TankParams p;
  EnergyTank tank(p, kDamper, kTick);
  double sent = 0;
  for (int k = 0; k < 1000; ++k) {
    tank.lend(0.0, 1);
    EXPECT_NEAR(tank.sent() - sent, p.rate * kTick * p.level, 1e-12);
    sent = tank.sent();
  }
  EXPECT_DOUBLE_EQ(tank.level(), p.level);
  EXPECT_EQ(tank.share(), 1.0);
  EXPECT_EQ(tank.damping(), 0.0);
}

// A law that wants to give power all the time, and a peer that took in what `told` says.
TEST(PortPassivity, GivesNoMoreThanThePeerTookInAndLetsGoOfItsCutOnceThatIsPaid) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int run = 0; run < 50; ++run) {
    PortPassivity port(kDamper, kTick);
    port.reset(0.0);
    double told = 0.0, v = 0.0, given = 0.0, least = 0.0;
    for (int k = 0; k < 4000; ++k) {
      v += 0.1 * unit(random) - 0.02 * v;
      const double law = v > 0 ? 0.5 : -0.4;  // always gives
      port.decide(law * v);
      const double damper = port.damping() * v, tau = port.share() * law - damper;
      if (k % 7 == 0) told += 1e-5;
      port.step(tau * v * kTick, damper * v * kTick, told);
      given += tau * v * kTick;
      least = std::min(least, port.margin());
      ASSERT_LE(given, told + 1e-3);
    }
    EXPECT_GE(least, -1e-3);
    EXPECT_LT(port.share(), 1.0);
    for (int k = 0; k < 1000; ++k) {  // the peer takes in more than is owed
      told += 1e-5;
      port.decide(0.0);
      port.step(0.0, 0.0, told);
    }
    port.decide(0.0);
    EXPECT_EQ(port.share(), 1.0);
    EXPECT_EQ(port.damping(), 0.0);
  }
}

TEST(PortPassivity, WhatItTakesInPaysItsOwnDeficitFirst) {
  PortPassivity port(kDamper, kTick);
  port.reset(5.0);  // heard before this engagement: nothing of it is owed to this one
  port.step(0.3e-3, 0.0, 5.0);
  EXPECT_NEAR(port.margin(), -0.3e-3, 1e-15);
  port.step(-0.5e-3, 0.0, 5.0);
  EXPECT_NEAR(port.margin(), 0.0, 1e-15);
  EXPECT_NEAR(port.in(), 0.2e-3, 1e-15);
}

TEST(PacketsWithEnergy, AreLongerByItAndRefusedWhereNoneIsKept) {
  PacketCodec<1> with({.energy = true}), without;
  Packet<1> packet, back;
  packet.session = packet.seq = 1;
  packet.energy = 0.1234;
  packet.friction = 0.05;
  packet.friction_known = true;
  const auto bytes = with.encode(packet);
  EXPECT_EQ(bytes.size(), PacketCodec<1>::kSize + PacketCodec<1>::kEnergyBytes);
  EXPECT_EQ(with.decode(bytes, back), DecodeResult::kOk);
  EXPECT_EQ(back.energy, 0.1234);
  EXPECT_EQ(back.friction, 0.05);
  EXPECT_TRUE(back.friction_known);
  EXPECT_EQ(without.decode(bytes, back), DecodeResult::kSize);
  EXPECT_EQ(with.decode(without.encode(packet), back), DecodeResult::kSize);
  packet.energy = std::nan("");
  EXPECT_EQ(with.decode(with.encode(packet), back), DecodeResult::kNotFinite);
}

void tanks_hold(const std::vector<double>& delays, int seeds) {
  double rest = 0, ratio = 0;
  int cells = 0;
  each_contact_cell(delays, seeds, false, [&](const ContactCell& cell) {
    const std::string name = cell.name();
    const LoadedScene loaded = load_scene("four_channel_tank", cell);
    const Metrics metrics = compute_metrics(simulate(loaded), loaded.scene);
    EXPECT_TRUE(metrics.is_true("stable")) << name;
    EXPECT_NEAR(metrics.number("force_ratio"), 1.0, 0.05) << name;
    rest = std::max(rest, metrics.number("residual_p2p_rad"));
    ratio = std::max(ratio, std::abs(metrics.number("force_ratio") - 1));
    ++cells;
  });
  std::printf("tanks, %d contacts: rest within %.1f mrad, steady torque off by at most %.1f %%\n", cells, 1e3 * rest,
              100 * ratio);
}

TEST(Tanks, EveryContactIsStableAndItsTorqueRight) { tanks_hold({0.02, 0.1}, 1); }
TEST(NightlyTanks, EveryContactIsStableAndItsTorqueRight) { tanks_hold({0.02, 0.1, 0.3, 0.5}, 10); }

// What a tank costs in free motion is told, not asked for: with four channels the old motion of the other side drags.
TEST(Tanks, NeverCutInFreeMotionOrContactOverNoDelayTo300Milliseconds) {
  for (const double delay_s : {0.0, 0.02, 0.1, 0.3}) {
    double drag = 0, level = 1;
    for (const char* environment : {"2", "5", "wall 1e4"}) {
      for (const char* grip : {"LIGHT", "NORMAL", "FIRM"}) {
        const LoadedScene loaded = load_scene("four_channel_tank", ContactCell{delay_s, environment, grip, 1}, true);
        const Session session = simulate(loaded);
        const Metrics metrics = compute_metrics(session, loaded.scene);
        for (const auto& [rows, signals] :
             {std::pair{&session.master, &session.master_signals}, std::pair{&session.slave, &session.slave_signals}}) {
          for (const StationSample& row : *rows)
            ASSERT_EQ(law_signal(row, *signals, "share"), 1.0) << delay_s << environment << grip << row.t_s;
        }
        level = std::min({level, metrics.number("account_min_master_j"), metrics.number("account_min_slave_j")});
        drag = std::max(drag, metrics.number("drag_nms_per_rad"));
      }
    }
    std::printf("%g s each way: drag at most %.3f N m s/rad, a tank at least %.4f J\n", delay_s, drag, level);
  }
}

TEST(Tanks, AlsoBehindAnMcu) {
  int unstable = 0, cells = 0;
  each_contact_cell({0.1}, 1, false, [&](const ContactCell& cell) {
    const std::string name = cell.name();
    LoadedScene loaded = load_scene("four_channel_tank", cell);
    loaded.scene.mutable_slave()->set_device(scene::SERIES_ELASTIC);
    loaded.scene.mutable_control()->set_k_f_per_kgm2(125);
    const Metrics metrics = compute_metrics(simulate(loaded), loaded.scene);
    EXPECT_NEAR(metrics.number("force_ratio"), 1.0, 0.05) << name;
    if (cell.grip != "LIGHT") {
      EXPECT_TRUE(metrics.is_true("stable")) << name;
    }
    unstable += metrics.is_true("stable") ? 0 : 1;
    ++cells;
  });
  std::printf("tanks behind an MCU: %d of %d contacts unstable, all with a light grip\n", unstable, cells);
}

void ports_hold(const std::vector<double>& delays, int seeds) {
  double least = 0, both = 0;
  int unstable = 0, weak = 0, cells = 0;
  each_contact_cell(delays, seeds, true, [&](const ContactCell& cell) {
    const std::string name = cell.name();
    const LoadedScene loaded = load_scene("two_channel_po_pc", cell);
    const Metrics metrics = compute_metrics(simulate(loaded), loaded.scene);
    for (const char* port : {"account_min_master_j", "account_min_slave_j"}) {
      EXPECT_GE(metrics.number(port), -1e-3) << name;
      least = std::min(least, metrics.number(port));
    }
    EXPECT_GE(metrics.number("energy_min_both_j"), -1e-3) << name << ", by the true torques";
    both = std::min(both, metrics.number("energy_min_both_j"));
    unstable += metrics.is_true("stable") ? 0 : 1;
    if (cell.environment != "free" && !(std::abs(metrics.number("force_ratio") - 1) <= 0.05)) ++weak;
    ++cells;
  });
  std::printf(
      "PO/PC, %d sessions: a port over by at least %.2f mJ, both by the true torques by %.2f mJ; %d unstable, "
      "%d with a steady torque off by more than 5 %%\n",
      cells, 1e3 * least, 1e3 * both, unstable, weak);
}

TEST(PassivityControllers, NoPortGivesMoreThanAMillijouleTooMuch) { ports_hold({0.0, 0.1}, 1); }
TEST(NightlyPassivityControllers, NoPortGivesMoreThanAMillijouleTooMuch) { ports_hold({0.0, 0.02, 0.1, 0.3, 0.5}, 5); }

// Where energy suffices, two channels are as they are without.
TEST(PassivityControllers, WithoutDelayAHandIsFeltThroughTheSpringThatHoldsTheMaster) {
  for (const double k : {0.5, 2.0, 5.0}) {
    const LoadedScene loaded = load_scene(
        "two_channel_po_pc", std::vector<std::string>{"network.forward={delay_s: 0}", "network.backward={delay_s: 0}",
                                                      "slave.hand.stiffness_nm_per_rad=" + std::to_string(k)});
    const Metrics metrics = compute_metrics(simulate(loaded), loaded.scene);
    EXPECT_TRUE(metrics.is_true("stable"));
    EXPECT_NEAR(metrics.number("force_ratio"), 1.0, 0.005);
    EXPECT_NEAR(metrics.number("k_seen_ratio"), 1 / (1 + k / 5), 0.005);
  }
}

}  // namespace
}  // namespace farhand
