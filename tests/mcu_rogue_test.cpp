// The MCU core alone against hosts that mean harm: whatever frames it is fed, the hand stays within its lines, measured
// at the hand. The streams of frames are searched for, not listed: of each kind of harm the worst found is changed a
// little, again and again.
#include "tests/support/mcu_rogue.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

namespace farhand::mcu {
namespace {

struct Harm {
  const char* name;
  double Felt::*most;
};
constexpr Harm kHarms[] = {{"speed", &Felt::speed},
                           {"angle", &Felt::angle},
                           {"power", &Felt::power},
                           {"mean power", &Felt::mean_power},
                           {"energy", &Felt::energy},
                           {"torque of the spring", &Felt::spring},
                           {"torque at the hand", &Felt::torque}};

std::string name_of(const Grasp& g) {
  std::ostringstream name;
  name << "K " << g.stiffness << ", spastic " << g.spastic << ", J " << g.inertia << ", motor " << g.motor_speed
       << " rad/s, " << g.counts << " counts";
  return name.str();
}

// Each harm has a budget of streams: a third of them anew, the others changes of the worst. What any of them did
// counts.
Felt search(const Grasp& grasp, const OrthosisEmulator::Params& params, int budget, std::uint64_t seed) {
  Felt worst;
  for (const Harm& harm : kHarms) {
    StreamMaker maker(seed++);
    Stream best = maker.anew();
    double most = -1;
    for (int n = 0; n < budget; ++n) {
      const Stream stream = n < budget / 3 ? maker.anew() : maker.changed(best, n % 3 != 0 ? 0.1 : 0.4);
      const Felt felt = RogueRun(grasp, params).run(stream, 0.6, static_cast<std::uint64_t>(n / 7));
      worst.add(felt);
      if (felt.*harm.most > most) most = felt.*harm.most, best = stream;
    }
  }
  return worst;
}

void print(const std::string& name, const Felt& f) {
  std::printf(
      "%s: %.2f rad/s, %.4f rad, %.2f W, %.2f W over 50 ms, %.1f mJ beyond 1.1 P t, %.3f N m of the spring, %.3f at "
      "the "
      "hand\n",
      name.c_str(), f.speed, f.angle, f.power, f.mean_power, f.energy * 1e3, f.spring, f.torque);
}

void expect_within_lines(const Grasp& grasp, const Felt& f) {
  const McuSettings s;
  constexpr double kDegree = M_PI / 180;
  const std::string name = name_of(grasp);
  EXPECT_LE(f.speed, 1.1 * s.velocity_limit) << name;
  EXPECT_LE(f.angle, s.range_max + (grasp.spastic >= 0.5 ? 4 : 1) * kDegree) << name;
  EXPECT_LE(f.energy, 1.1 * s.J_n * s.velocity_limit * s.velocity_limit / 2) << name;
  EXPECT_LE(f.mean_power, 2.9) << name;
  if (grasp.spastic == 0) {
    EXPECT_LE(f.power, (grasp.stiffness <= 5 ? 1.1 : 1.5) * s.power_limit) << name;
  }
  EXPECT_LE(f.command, s.torque_limit) << name;
  EXPECT_LE(f.spring, s.torque_limit + 0.05) << name;
  EXPECT_LE(f.torque, s.torque_limit + 0.05) << name;
}

std::vector<Grasp> every_grasp() {
  std::vector<Grasp> all;
  for (const double inertia : {0.7, 1.0, 1.5}) {
    for (const double motor_speed : {4.0, 8.0}) {
      for (const double counts : {4096.0, 20000.0}) {
        const auto add = [&](double stiffness, double spastic) {
          all.push_back({stiffness, spastic, 0.02, inertia, motor_speed, counts});
        };
        for (const double stiffness : {0.5, 2.0, 5.0, 20.0}) add(stiffness, 0);
        for (const double stiffness : {1.0, 2.5, 5.0}) add(stiffness, 0.3), add(stiffness, 0.5);
      }
    }
  }
  return all;
}

Felt search_all(const std::vector<Grasp>& grasps, int budget, std::uint64_t seed) {
  Felt all;
  for (const Grasp& grasp : grasps) {
    const Felt felt = search(grasp, orthosis_of(grasp), budget, seed);
    seed += 100;
    expect_within_lines(grasp, felt);
    all.add(felt);
  }
  return all;
}

TEST(McuRogue, NoStreamOfFramesTakesTheHandBeyondItsLines) {
  const Felt all = search_all(every_grasp(), 12, 1);
  print("all hands", all);
  EXPECT_GT(all.driven_s, 0.3 * 0.6 * 12 * 7 * static_cast<double>(every_grasp().size()));
  EXPECT_GT(all.speed, 3.0);  // else nothing was searched
  EXPECT_GT(all.spring, 2.5);
}

// Where nothing bounds the hand but the torque and what the motor can do, the same search throws it into its stop.
TEST(McuRogue, TheSearchFindsWhatThereIsWithoutTheBound) {
  Felt all;
  for (const double stiffness : {0.5, 5.0}) {
    Grasp grasp;
    grasp.stiffness = stiffness;
    OrthosisEmulator::Params params = orthosis_of(grasp);
    params.mcu.velocity_limit = 1000, params.mcu.power_limit = 1e4;
    params.mcu.range_min = -1, params.mcu.range_max = 1;
    all.add(search(grasp, params, 60, 1));
  }
  print("without the bound", all);
  EXPECT_GE(all.speed, 8);
  EXPECT_GE(all.angle, 0.5);
  EXPECT_GE(all.power, 8);
}

// What becomes of the hand once the host lets go of it, by silence, by SAFE or by a stop, is what an honest stop in the
// same millisecond does to it. Below a quarter of the limits no difference counts.
void expect_let_go_as_by_a_stop(const std::vector<Grasp>& grasps, int budget, std::uint64_t seed) {
  const McuSettings s;
  int let_go = 0;
  double worst_speed = 0, worst_power = 0, fastest = 0, strongest = 0;
  for (const Grasp& grasp : grasps) {
    const OrthosisEmulator::Params params = orthosis_of(grasp);
    StreamMaker maker(seed++);
    Stream best = maker.anew();
    double most = -1;
    for (int n = 0; n < budget; ++n) {
      const Stream stream = n < budget / 3 ? maker.anew() : maker.changed(best, n % 3 != 0 ? 0.1 : 0.4);
      RogueRun rogue(grasp, params);
      const Felt felt = rogue.run(stream, 0.4, 1);
      if (rogue.let_go_ms() < 0) continue;
      ++let_go;
      const Felt honest = RogueRun(grasp, params).run(stream, 0.4, 1, rogue.let_go_ms());
      const double speed = felt.speed_after / std::max(honest.speed_after, 0.25 * s.velocity_limit);
      const double power = felt.power_after / std::max(honest.power_after, 0.25 * s.power_limit);
      worst_speed = std::max(worst_speed, speed), worst_power = std::max(worst_power, power);
      fastest = std::max(fastest, felt.speed_after), strongest = std::max(strongest, felt.power_after);
      if (std::max(speed, power) > most) most = std::max(speed, power), best = stream;
    }
  }
  std::printf(
      "let go %d times: at most %.3f of the speed and %.3f of the power by an honest stop; %.2f rad/s, %.2f W\n",
      let_go, worst_speed, worst_power, fastest, strongest);
  EXPECT_GT(let_go, budget * static_cast<int>(grasps.size()) / 4);
  EXPECT_LE(worst_speed, 1.1);
  EXPECT_LE(worst_power, 1.1);
}

TEST(McuRogue, LetsGoOfTheHandAsAnHonestStopDoes) { expect_let_go_as_by_a_stop(every_grasp(), 12, 7); }

// A million streams.
TEST(NightlyMcuRogue, NoStreamOfFramesTakesTheHandBeyondItsLines) {
  const std::vector<Grasp> grasps = every_grasp();
  const int budget = 1'000'000 / (static_cast<int>(std::size(kHarms)) * static_cast<int>(grasps.size())) + 1;
  const Felt all = search_all(grasps, budget, 1'000'001);
  print("all hands", all);
}
TEST(NightlyMcuRogue, LetsGoOfTheHandAsAnHonestStopDoes) { expect_let_go_as_by_a_stop(every_grasp(), 1000, 7); }

}  // namespace
}  // namespace farhand::mcu
