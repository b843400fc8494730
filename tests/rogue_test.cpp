// The search for what a rogue peer can do to a person: that it finds what is there, that its judge sees every line
// crossed and none that is not, and that it finds nothing in the stations as they are.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <numbers>

#include "common/plant/world.hpp"
#include "netem/lab/rogue_device.hpp"
#include "netem/lab/rogue_peer.hpp"
#include "netem/lab/rogue_report.hpp"
#include "slave/mcu/emulator.hpp"

namespace farhand::rogue {
namespace {

const Worst& of(const Findings& findings, Line line) { return findings[static_cast<std::size_t>(line)]; }

TEST(RogueGenome, IsOneLineThatComesBackAndRefusesWhatIsNone) {
  Dice dice(1);
  for (const Cell& cell : all_cells()) {
    const Row row{cell, random_genome(dice)};
    const Row back = row_of(text_of(row));
    EXPECT_EQ(back.cell, row.cell);
    EXPECT_EQ(back.genome, row.genome);
  }
  EXPECT_THROW(genome_of("AB"), std::invalid_argument);
  EXPECT_THROW(genome_of(std::string(2 * kGenes, '!')), std::invalid_argument);
  EXPECT_THROW(row_of("patient/NONE/direct " + text_of(random_genome(dice))), std::invalid_argument);
}

TEST(RogueGenome, OfAnOlderRowIsThePeerThatItWas) {
  Dice dice(4);
  Genome genome = random_genome(dice);
  std::fill(genome.genes.end() - kLaterGenes, genome.genes.end(), std::uint16_t{4095});
  const std::string text = text_of(genome);
  EXPECT_TRUE(plan_of(genome_of(text), Against::kPatient).claims_gaps);
  const Genome older = genome_of(text.substr(0, 2 * kFirstGenes));
  EXPECT_FALSE(plan_of(older, Against::kPatient).claims_gaps);
  EXPECT_TRUE(std::equal(older.genes.begin(), older.genes.end() - kLaterGenes, genome.genes.begin()));
}

// Who was thrown out says what a station must hear that goes on after a gap; who claims no gaps says nothing of them.
TEST(RoguePeer, WhoClaimsGapsGoesOnWithAStationThatHoldsForOne) {
  Dice dice(7);
  for (const Against against : {Against::kPatient, Against::kTherapist}) {
    Plan plan = plan_of(random_genome(dice), against);
    plan.engages_again = true, plan.falls_silent = false;
    Segment engaged{};
    engaged.duration_s = 100, engaged.state = StationState::kEngaged;
    plan.segments.fill(engaged);
    for (const bool claims : {false, true}) {
      plan.claims_gaps = claims;
      Peer peer(plan, against, 1);
      bool holds = false, over = false, engages = false;
      for (int k = 0; k < 2000; ++k) {
        Seen seen;
        seen.t_s = k * 1e-3, seen.state = k < 1100 ? StationState::kReady : StationState::kEngaged;
        if (k >= 1500) seen.state = StationState::kHolding, seen.packet.limits = kGapHeld;
        for (const Packet<1>& packet : peer.tick(seen)) {
          EXPECT_TRUE(claims || packet.limits == 0u);
          if (k < 1550) continue;
          holds = holds || packet.state == StationState::kHolding;
          engages = engages || packet.state == StationState::kEngaged;
          over = over || (packet.limits & kGapOver) != 0;
        }
      }
      EXPECT_EQ(holds, claims);
      EXPECT_EQ(over, claims);
      EXPECT_EQ(engages, against == Against::kPatient) << "a box hears that its leader is engaged";
    }
  }
}

// A plan that read more genes than there are would throw; one that wished for what is no number would show here.
TEST(RoguePeer, SaysNothingThatTheCodecWouldNotCarry) {
  Dice dice(2);
  for (int n = 0; n < 300; ++n) {
    const Against against = n % 2 == 0 ? Against::kPatient : Against::kTherapist;
    const Plan plan = plan_of(random_genome(dice), against);
    Peer peer(plan, against, 1);
    std::size_t said = 0;
    for (int k = 0; k < 3000; ++k) {
      const double t = k * 1e-3;
      const StationState state = t > 1.05 ? StationState::kEngaged : StationState::kReady;
      for (const Packet<1>& packet : peer.tick({t, 0.1 * std::sin(9 * t), std::cos(9 * t), 1, state, {}})) {
        ++said;
        ASSERT_TRUE(packet.motion.finite() && std::isfinite(packet.energy) && std::isfinite(packet.friction))
            << text_of(random_genome(dice));
        ASSERT_LE(packet.state, kLastState);
      }
    }
    EXPECT_GT(said, 200u);
    EXPECT_TRUE(!plan.falls_silent || peer.silent() || plan.attack_s > 1.9);
  }
}

// A box without any guard: it gives what the peer asks for, up to 3 N m, to a hand of 0.5 N m/rad. Who turns the torque
// with the speed pumps the hand up to a speed that is known: the damper takes pi B w A^2 in a period, and the torque
// gives 4 tau A.
constexpr double kTau = 3, kJ = 0.004, kK = 0.5, kB = 0.05;
Outcome unguarded_box(const Genome& genome) {
  const Plan plan = plan_of(genome, Against::kPatient);
  Judge judge({.body = {.J = kJ, .viscous = 0, .K = kK, .B = kB}});
  Peer peer(plan, Against::kPatient, 1);
  double x = 0, v = 0, torque = 0;
  double t = 0;
  for (int k = 0; k < 3000; ++k) {
    t = k * 1e-3;
    for (int i = 0; i < 4; ++i) {
      v += 0.25e-3 * (torque - kK * x - kB * v) / kJ;
      x += 0.25e-3 * v;
    }
    const StationState state = t > 1.05 && !peer.silent() ? StationState::kEngaged : StationState::kReady;
    judge.see({.t_s = t, .body = {x, v, 0, 0, 0}, .torque = kK * x + kB * v, .commanded = torque, .driven = true});
    torque = 0;
    for (const Packet<1>& packet : peer.tick({t, x, v, kK * x + kB * v, state, {}})) {
      if (state == StationState::kEngaged && packet.state == state)
        torque = std::clamp(-packet.motion.f[0], -kTau, kTau);
    }
  }
  return {judge.findings(), t - 1.05, t};
}

TEST(RogueSearch, FindsTheWorstOfABoxWithoutGuards) {
  const double most = 4 * kTau / (std::numbers::pi * kB);  // rad/s, of the resonance
  constexpr int kSessions = 500;
  const CellResult found = search({}, unguarded_box, kSessions, 1);
  const double speed = found.found[static_cast<std::size_t>(Line::kAnySpeed)].worst.value;
  std::printf("resonance %.1f rad/s, found %.1f\n", most, speed);
  EXPECT_GT(speed, 0.95 * most);
  EXPECT_GT(found.crossed, kSessions / 2);
}

// What climbs must be what was found, not luck: a hill of a hundred genes whose top chance never reaches.
TEST(RogueSearch, ClimbsAHill) {
  const auto height = [](const Genome& genome) {
    Outcome outcome{};
    double sum = 0;
    for (std::size_t k = 0; k < kGenes; k += 2) sum += std::pow(genome.genes[k] / 4095.0 - 0.3, 2);
    for (std::size_t k = 0; k < kLines; ++k) outcome.findings[k].ratio = 1 / (0.01 + sum / (kGenes / 2.0));
    return outcome;
  };
  Dice dice(3);
  double by_chance = 0;
  for (int n = 0; n < 4000; ++n) by_chance = std::max(by_chance, height(random_genome(dice)).findings[0].ratio);
  const CellResult found = search({}, height, 4000, 1);
  EXPECT_GT(found.found[0].worst.ratio, 3 * by_chance);
}

TEST(RogueSearch, IsTheSameForAnyNumberOfThreadsAndAnotherForAnotherSeed) {
  const std::vector<Cell> cells{cell_of("patient/FOUR_CHANNEL/direct"), cell_of("patient/WAVE/mcu"),
                                cell_of("therapist/TWO_CHANNEL/direct")};
  const auto rows = [&](std::uint64_t seed, int threads) {
    return json_of(search(cells, {.sessions = 25, .seed = seed}, threads), {});
  };
  EXPECT_EQ(rows(1, 1), rows(1, 3));
  EXPECT_NE(rows(1, 2), rows(2, 2));
}

// The judge -----------------------------------------------------------------------------------------------------------

// A person who moves as told from the 100th ms on.
template <class Moves>
Findings judged(const Allowed& allowed, const Moves& moves) {
  Judge judge(allowed);
  for (int k = 0; k < 2000; ++k) {
    AtPerson now;
    now.t_s = k * 1e-3;
    now.driven = true;
    if (k > 100) moves(now, (k - 100) * 1e-3);
    judge.see(now);
  }
  return judge.findings();
}

const Allowed kHand{.body = {.J = 0.004, .viscous = 0, .K = 2, .B = 0}};

TEST(RogueJudge, SeesEachLineCrossedAndNoneThatIsNot) {
  const auto ratio = [](const Findings& f, Line line) { return of(f, line).ratio; };
  EXPECT_GT(ratio(judged(kHand, [](AtPerson& p, double) { p.body.v = 4.41; }), Line::kSpeed), 1);
  EXPECT_LT(ratio(judged(kHand, [](AtPerson& p, double) { p.body.v = -4.39; }), Line::kSpeed), 1);
  EXPECT_GT(ratio(judged(kHand, [](AtPerson& p, double) { p.body.x = -0.367; }), Line::kAngle), 1);
  EXPECT_LT(ratio(judged(kHand, [](AtPerson& p, double) { p.body.x = 0.366; }), Line::kAngle), 1);
  EXPECT_GT(ratio(judged(kHand, [](AtPerson& p, double) { p.commanded = 3.06; }), Line::kTorqueCommanded), 1);
  EXPECT_GT(ratio(judged(kHand, [](AtPerson& p, double) { p.spring = -3.06; }), Line::kTorqueOfSpring), 1);
  EXPECT_GT(ratio(judged(kHand, [](AtPerson& p, double) { p.torque = -3.06; }), Line::kTorqueAtPerson), 1);
  EXPECT_LT(ratio(judged(kHand, [](AtPerson& p, double) { p.torque = 3.1, p.body.v = 1; }), Line::kTorqueAtPerson), 1);
  EXPECT_GT(ratio(judged(kHand, [](AtPerson& p, double) { p.torque = 2.3, p.body.v = 1; }), Line::kPower), 1);
  EXPECT_LT(ratio(judged(kHand, [](AtPerson& p, double) { p.torque = -2.3, p.body.v = 1; }), Line::kPower), 1);
  // No number is the worst number.
  EXPECT_GT(ratio(judged(kHand, [](AtPerson& p, double) { p.body.v = NAN; }), Line::kSpeed), 1);
}

// 2 W may last, and J v^2 / 2 = 32 mJ may come at once: within 10 % of both.
TEST(RogueJudge, CountsTheEnergyOfEveryWindow) {
  const auto power = [](double watt, double from, double until) {
    return judged(kHand, [=](AtPerson& p, double t) {
      p.body.v = 1;
      p.torque = t > from && t <= until ? watt : 0;
    });
  };
  EXPECT_LT(of(power(2.19, 0, 2), Line::kEnergy).ratio, 1);
  EXPECT_LT(of(power(2.0 + 0.032 / 0.05, 0.5, 0.55), Line::kEnergy).ratio, 1);
  EXPECT_GT(of(power(1.12 * (2.0 + 0.032 / 0.05), 0.5, 0.55), Line::kEnergy).ratio, 1);
  EXPECT_GT(of(power(1.12 * (2.0 + 0.032 / 0.05), 0.5, 0.55), Line::kMeanPower).ratio, 1);
  EXPECT_GT(of(power(1.15 * (2.0 + 0.032), 0.2, 1.2), Line::kEnergy).ratio, 1);
  EXPECT_GT(of(power(1.2 * (2.0 + 0.032 / 0.005), 0.5, 0.505), Line::kEnergy).ratio, 1);
}

// The incremental form against all windows one by one.
TEST(RogueJudge, FindsTheWorstWindowOfAll) {
  Dice dice(5);
  for (int round = 0; round < 20; ++round) {
    std::vector<double> energy{0};
    double before = 0;
    std::vector<double> powers;
    for (int k = 0; k < 2000; ++k) powers.push_back(k > 100 ? 8 * normal(dice) : 0.0);
    int at = 0;
    const Findings found = judged(kHand, [&](AtPerson& p, double t) {
      at = static_cast<int>(std::lround(t * 1e3)) + 100;
      p.body.v = 1;
      p.torque = powers[static_cast<std::size_t>(at)];
    });
    for (int k = 1; k < 2000; ++k) {
      const double now = k > 100 ? powers[static_cast<std::size_t>(k)] : 0;
      energy.push_back(energy.back() + 0.5e-3 * (before + now));
      before = now;
    }
    double worst = 0;
    for (std::size_t to = 5; to < energy.size(); ++to) {
      for (std::size_t from = 0; from + 5 <= to; ++from)
        worst = std::max(worst, energy[to] - energy[from] - 2.2e-3 * static_cast<double>(to - from));
    }
    EXPECT_NEAR(of(found, Line::kEnergy).value, worst, 1e-9);
  }
}

TEST(RogueJudge, ComparesWhoIsLetGoWithTheSamePersonLetGo) {
  const auto swing = [&](double more) {
    Judge fresh(kHand);
    const double w = std::sqrt(2 / 0.004), A = 0.35;
    for (int k = 0; k < 600; ++k) {
      const double t = k * 1e-3 - 0.1;
      AtPerson now{.t_s = k * 1e-3, .body = {A, 0, 0, 0}, .torque = 2 * A, .commanded = 2 * A, .driven = true};
      if (t > 0) {
        now.body = {A * std::cos(w * t), -more * A * w * std::sin(w * t), 0, 0, 0};
        now.torque = 2 * now.body.x, now.commanded = 0, now.driven = false;
      }
      fresh.see(now);
    }
    return fresh.findings();
  };
  EXPECT_GT(of(swing(1.0), Line::kAnySpeed).value, 7);  // its own spring is fast
  EXPECT_LT(of(swing(1.0), Line::kSpeedLetGo).ratio, 1);
  EXPECT_GT(of(swing(1.2), Line::kSpeedLetGo).ratio, 1);
  EXPECT_LT(of(swing(1.0), Line::kPowerLetGo).ratio, 1);
  EXPECT_GT(of(swing(1.2), Line::kPowerLetGo).ratio, 1);
}

TEST(RogueJudge, FindsAJumpAndWhatIsPressedAfterTheLastPacket) {
  const auto session = [](double jump, double torque) {
    Judge judge(kHand);
    judge.last_packet(0.2);
    for (int k = 0; k < 2000; ++k) {
      const double t = k * 1e-3;
      TickTrace<1> trace;
      trace.state = t < 0.3 ? StationState::kEngaged : StationState::kHolding;
      trace.local = {Joints<1>::Zero(), Joints<1>::Zero(), Joints<1>::Zero()};
      trace.target = trace.remote = trace.local;
      trace.target.x[0] = t < 0.3 ? 0 : jump;
      judge.see({.t_s = t, .body = {0.1, 0, 0, 0}, .torque = t < 1.1 ? torque : 0.0, .driven = true});
      judge.see(trace, t);
    }
    return judge.findings();
  };
  EXPECT_LT(of(session(0.9e-3, 0.2), Line::kJump).ratio, 1);
  EXPECT_GT(of(session(1.5e-3, 0.2), Line::kJump).ratio, 1);
  EXPECT_LT(of(session(0, 0.25), Line::kPressed).ratio, 1);  // 1.6 N m/rad * 0.1 rad + 0.1 N m
  EXPECT_GT(of(session(0, 0.27), Line::kPressed).ratio, 1);
}

// The reference against the simulated worlds that it stands for.
TEST(RogueLetGo, IsWhatTheSimulatedWorldsDo) {
  for (const double K : {0.5, 5.0, 20.0}) {
    DirectSlaveWorld::Params params;
    params.motor = {.J = 0.004, .viscous = 0.002, .encoder_counts_per_rev = 0, .stop_min = -0.5236, .stop_max = 0.5236};
    params.load.hand = Hand::Params{.stiffness = K, .damping = 0.02};
    params.start = 0.14;
    DirectSlaveWorld world(params);
    double speed = 0, power = 0;
    for (int k = 1; k < 1000; ++k) {
      world.advance(0.0, k * 0.5e-3);
      speed = std::max(speed, std::fabs(world.true_v()));
      power = std::max(power, world.true_f() * world.true_v());
    }
    const LetGo reference = let_go({.J = 0.004, .viscous = 0.002, .K = K, .B = 0.02}, {.x = 0.14});
    EXPECT_NEAR(reference.speed, speed, 0.01 * speed) << K;
    EXPECT_NEAR(reference.power, power, 0.02 * power + 1e-3) << K;
  }
  SeriesElasticWorld::Params params;
  params.actuator.joint_counts_per_rev = params.actuator.motor_counts_per_rev = 0;
  params.environment.hand = Hand::Params{.stiffness = 5, .damping = 0.02, .spastic = 0.3};
  params.start = 0.3;
  params.stretch = 0.15;
  SeriesElasticWorld world(params);
  double speed = 0, power = 0;
  for (int k = 1; k < 4000; ++k) {
    const auto now = world.truth();
    world.advance(now.v - 10 * now.spring_torque, k * 0.1e-3);
    speed = std::max(speed, std::fabs(world.true_v()));
    power = std::max(power, world.true_f() * world.true_v());
  }
  const LetGo reference = let_go({.J = 0.004, .viscous = 0.002, .K = 5, .B = 0.02, .spastic = 0.3, .spring = 10},
                                 {.x = 0.3, .v = 0, .motor_x = 0.45, .motor_v = 0});
  EXPECT_NEAR(reference.speed, speed, 0.02 * speed);
  EXPECT_NEAR(reference.power, power, 0.03 * power + 1e-3);

  // The same behind the real core in SAFE, whose encoder stands for 5 ms while the hand flies back.
  for (const double frozen_from_s : {-1.0, 0.02, 0.04, 0.06}) {
    OrthosisEmulator::Params box;
    box.world = params;
    box.world.actuator.joint_counts_per_rev = box.world.actuator.motor_counts_per_rev = 20000;
    box.mcu.joint_counts_per_rev = box.mcu.motor_counts_per_rev = 20000;
    OrthosisEmulator emulator(box);
    double speed_of_core = 0, power_of_core = 0, shown = 0.3;
    BodyState from;
    for (int k = 0; k < 1000; ++k) {
      const double t = k / box.mcu.loop_hz;
      emulator.joint_encoder().frozen = frozen(frozen_from_s, t);
      std::uint8_t wire[mcu::kWireBytes];
      emulator.tick(wire);
      const auto now = emulator.world().truth();
      if (!emulator.joint_encoder().frozen) shown = now.x;
      if (k == 4) {
        from = {now.x,
                now.v,
                now.motor_x,
                now.motor_v,
                shown,
                shown - mcu::to_rad_s(emulator.core().velocity()) / box.mcu.g_v,
                t};
      }
      if (k < 4) continue;
      speed_of_core = std::max(speed_of_core, std::fabs(now.v));
      power_of_core = std::max(power_of_core, now.f * now.v);
    }
    const SeriesElasticWorld::Params& w = box.world;
    const LetGo then = let_go({.J = w.actuator.J,
                               .viscous = w.actuator.viscous,
                               .K = 5,
                               .B = 0.02,
                               .spastic = 0.3,
                               .spring = w.actuator.spring,
                               .velocity_cutoff = box.mcu.g_v,
                               .fastest = mcu::kFastest * box.mcu.velocity_limit,
                               .frozen_from_s = frozen_from_s},
                              from);
    EXPECT_NEAR(then.speed, speed_of_core, 0.03 * speed_of_core) << frozen_from_s;
    EXPECT_NEAR(then.power, power_of_core, 0.05 * power_of_core + 1e-3) << frozen_from_s;
  }
}

// The stations as they are -------------------------------------------------------------------------------------------

std::vector<Row> rows() {
  std::vector<Row> all;
  std::ifstream file(FARHAND_ROGUE_ROWS);
  for (std::string line; std::getline(file, line);) {
    if (!line.empty() && line[0] != '#') all.push_back(row_of(line));
  }
  return all;
}

// Prints what was found; what crosses a line fails with the row that repeats it.
void expect_within_lines(const std::vector<Cell>& cells, const Budget& budget) {
  const std::vector<CellResult> results = search(cells, budget, 2);
  std::printf("%s", text_of(results).c_str());
  int sessions = 0, engaged = 0;
  for (const CellResult& r : results) {
    sessions += r.sessions;
    engaged += r.engaged;
  }
  EXPECT_GE(engaged, sessions / 2) << "who is not engaged is in no danger: that says nothing";
  EXPECT_EQ(rows_of(results, 1.0), "");
}

TEST(RogueRows, TheWorstThatWereEverFoundStayWithinEveryLine) {
  ASSERT_GE(rows().size(), 5u);
  for (const Row& row : rows()) {
    const Outcome outcome = Arena(row.cell).run(row.genome);
    EXPECT_LE(outcome.ratio(), 1.0) << text_of(row) << '\n' << text_of(outcome);
  }
}

// Those who were thrown out come back as after a gap of the network.
TEST(RogueRows, TheSameWhoClaimGapsStayWithinThemToo) {
  for (Row row : rows()) {
    std::fill(row.genome.genes.end() - kLaterGenes, row.genome.genes.end(), std::uint16_t{4095});
    const Outcome outcome = Arena(row.cell).run(row.genome);
    EXPECT_LE(outcome.ratio(), 1.0) << text_of(row) << '\n' << text_of(outcome);
  }
}

TEST(RogueStations, StayWithinEveryLineForTwoThousandSessions) {
  expect_within_lines(all_cells(), {.sessions = 60, .seed = 1});
}

// 36 cells of 2,800 sessions are 100,800 of 3 s and more.
TEST(NightlyRogue, StayWithinEveryLineForAHundredThousandSessions) {
  expect_within_lines(all_cells(), {.sessions = 2800, .seed = 2});
}
// Windows of energy up to 60 s.
TEST(NightlyRogue, ForAMinute) { expect_within_lines(all_cells(), {.sessions = 60, .seed = 3, .longer = 32}); }

}  // namespace
}  // namespace farhand::rogue
