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
// same millisecond does to it, watched until the hand has swung. Below a quarter of the limits no difference counts.
// Where the host takes it again before it has come to rest, and lets go again, and so on, it is moved no faster than by
// that stop or than a driven hand may be; nor with more power, but a spastic one, whose catch is its own.
struct AgainstAStop {
  double speed = 0, power = 0, speed_taken = 0, power_taken = 0;  // shares
  double fastest = 0, strongest = 0;                              // rad/s, W
  int let_gos = 0, taken = 0;

  double most() const { return std::max({speed, power, speed_taken, power_taken}); }
  void add(const AgainstAStop& other) {
    for (double AgainstAStop::*one : {&AgainstAStop::speed, &AgainstAStop::power, &AgainstAStop::speed_taken,
                                      &AgainstAStop::power_taken, &AgainstAStop::fastest, &AgainstAStop::strongest}) {
      this->*one = std::max(this->*one, other.*one);
    }
    let_gos += other.let_gos, taken += other.taken;
  }
};

AgainstAStop against_a_stop(const Grasp& grasp, const OrthosisEmulator::Params& params, const Stream& stream) {
  constexpr double kRuns = 0.4, kSwings = 0.5;  // s
  const McuSettings s;
  RogueRun rogue(grasp, params);
  rogue.run(stream, kRuns, 1);
  AgainstAStop result;
  if (rogue.let_gos().empty()) return result;
  // A host that flaps lets go very often: the first, and those that the hand feels most.
  std::vector<std::size_t> judged = {0};
  for (double LetGo::*most : {&LetGo::speed, &LetGo::power, &LetGo::speed_taken, &LetGo::power_taken}) {
    const auto worst = std::max_element(rogue.let_gos().begin(), rogue.let_gos().end(),
                                        [&](const LetGo& a, const LetGo& b) { return a.*most < b.*most; });
    judged.push_back(static_cast<std::size_t>(worst - rogue.let_gos().begin()));
  }
  std::sort(judged.begin(), judged.end());
  judged.erase(std::unique(judged.begin(), judged.end()), judged.end());
  for (const std::size_t n : judged) {
    const LetGo& felt = rogue.let_gos()[n];
    RogueRun stopped(grasp, params);
    stopped.run(stream, felt.ms * 1e-3 + kSwings, 1, felt.ms);
    const LetGo& honest = stopped.let_gos().back();
    const double power_driven = (grasp.stiffness <= 5 ? 1.0 : 1.5 / 1.1) * s.power_limit;
    result.add({felt.speed / std::max(honest.speed, 0.25 * s.velocity_limit),
                felt.power / std::max(honest.power, 0.25 * s.power_limit),
                felt.speed_taken / std::max(honest.speed, s.velocity_limit),
                grasp.spastic > 0 ? 0 : felt.power_taken / std::max(honest.power, power_driven), felt.speed, felt.power,
                1, felt.speed_taken > 0});
  }
  return result;
}

void expect_let_go_as_by_a_stop(const std::vector<Grasp>& grasps, int budget, std::uint64_t seed) {
  AgainstAStop all;
  for (const Grasp& grasp : grasps) {
    const OrthosisEmulator::Params params = orthosis_of(grasp);
    StreamMaker maker(seed++);
    Stream best = maker.anew();
    double most = -1;
    for (int n = 0; n < budget; ++n) {
      const Stream stream = n < budget / 3 ? maker.anew() : maker.changed(best, n % 3 != 0 ? 0.1 : 0.4);
      const AgainstAStop one = against_a_stop(grasp, params, stream);
      all.add(one);
      if (one.most() > most) most = one.most(), best = stream;
    }
    EXPECT_LE(most, 1.1) << name_of(grasp);
  }
  std::printf(
      "let go %d times: at most %.3f of the speed and %.3f of the power by an honest stop; taken again in its swing %d "
      "times: %.3f, %.3f; %.2f rad/s, %.2f W\n",
      all.let_gos, all.speed, all.power, all.taken, all.speed_taken, all.power_taken, all.fastest, all.strongest);
  EXPECT_GT(all.let_gos, budget * static_cast<int>(grasps.size()) / 4);
  EXPECT_GT(all.taken, budget * static_cast<int>(grasps.size()) / 20);
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
