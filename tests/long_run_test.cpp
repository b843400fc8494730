// Hours of virtual time: nothing may grow, and the loop of the lab may not touch the heap once it runs.
#include <gtest/gtest.h>

#include <cstdio>

#include "common/config/world_params.hpp"
#include "netem/lab/audited_sides.hpp"
#include "netem/lab/endure.hpp"
#include "tests/support/alloc_counter.hpp"

namespace farhand {
namespace {

using Sets = std::vector<std::string>;

// Notes what the loop has touched since the first tick of the slave.
class Idle final : public Witness {
 public:
  void ticked(bool master, const Side&, double, OperatorAct) override {
    if (master) return;
    if (ticks++ == 0) first = touched();
    last = touched();
  }
  Touched first, last;
  std::uint64_t ticks = 0;
};

TEST(LongRun, LoopWithoutRecordingTouchesNeitherHeapNorMutex) {
  if (kCounterIsBlind) GTEST_SKIP() << "a sanitizer owns malloc and the mutexes";
  for (const std::string& name : known_scenes()) {
    const LoadedScene loaded = load_scene(name);
    const Sides sides = make_sides(loaded.scene);
    Idle idle;
    simulate(loaded, sides, idle);
    EXPECT_GT(idle.ticks, 10000u) << name;
    EXPECT_EQ(idle.last, idle.first) << name;
  }
}

std::vector<Stretch> endured(const LoadedScene& loaded, double stretch_s) {
  std::vector<Stretch> all;
  all.reserve(1000);
  endure(loaded, stretch_s, [&](const Stretch& stretch) { all.push_back(stretch); });
  return all;
}

TEST(LongRun, ATherapistWhoGivesWayIsNotAudited) {
  const LoadedScene loaded = load_scene("therapist_reaction");
  Balances balances;
  EXPECT_THROW(make_audited_sides(loaded.scene, balances), std::invalid_argument);
}

TEST(LongRun, AuditChangesNoNumber) {
  for (const char* scene : {"demo", "gravity"}) {
    const LoadedScene loaded = load_scene(scene, Sets{"windows={}", "duration_s=8"});
    struct Last final : Witness {
      void ticked(bool, const Side& side, double, OperatorAct) override {
        sum = 1.7 * sum + side.truth().x + side.truth().f;
      }
      double sum = 0;
    } plain, audited;
    Balances balances;
    simulate(loaded, make_sides(loaded.scene), plain);
    simulate(loaded, make_audited_sides(loaded.scene, balances), audited);
    EXPECT_EQ(plain.sum, audited.sum);
    EXPECT_GT(balances.master.exchanged_j, 0.05);
    EXPECT_GT(balances.slave.exchanged_j, 0.02);
  }
}

// A session of the demo that begins at begin_s, after rest: what its world makes of nothing, and what rounding may
// make.
template <class World>
EnergyBalance session_at(double begin_s, const typename World::Params& params, double amplitude) {
  World world(params);
  EnergyAudit<World> audit(params, {});
  EnergyBalance balance;
  double t_s = 0;
  if (begin_s > 0) {
    world.advance(0, begin_s);
    audit.add(world, 0, 0, begin_s, balance);
    t_s = begin_s, balance = {};
  }
  const Nanoseconds begin = from_seconds(begin_s);
  for (int k = 1; k <= 18500; ++k) {
    const double input = amplitude * std::sin(4.4e-3 * k), t1_s = to_seconds(begin + k * Nanoseconds{1'000'000});
    world.advance(input, t1_s);
    audit.add(world, input, t_s, t1_s, balance);
    t_s = t1_s;
  }
  return balance;
}

// At a day, three days and seven weeks: where the lattice of times is coarse enough to be seen, and where it is so
// coarse that ticks have two lengths for the closed form.
TEST(LongRun, ClockThatIsLateMakesNoEnergy) {
  for (const double begin_s : {0.0, 16384.0, 32768.0, 86400.0, 262144.0, 4194304.0}) {
    scene::Scene scene = load_scene("demo").scene;
    scene::Therapist& therapist = *scene.mutable_master()->mutable_therapist();
    const auto session = therapist.intended();
    therapist.clear_intended();
    if (begin_s > 0) therapist.add_intended()->set_duration_s(begin_s);
    therapist.mutable_intended()->MergeFrom(session);
    scene.mutable_slave()->mutable_hand()->set_from_s(0);
    const EnergyBalance master = session_at<MasterWorld>(begin_s, master_world_params(scene), 0.1);
    const EnergyBalance slave = session_at<SeriesElasticWorld>(begin_s, series_elastic_world_params(scene), 0.5);
    for (const EnergyBalance& balance : {master, slave}) {
      EXPECT_LE(std::fabs(balance.residual_j), balance.rounding_j) << begin_s;
      EXPECT_GT(balance.exchanged_j, 0.05);
    }
    std::printf("begun at %7.0f s: residual %.2g %.2g J, may be %.2g %.2g J, of %.2g %.2g J\n", begin_s,
                master.residual_j, slave.residual_j, master.rounding_j, slave.rounding_j, master.exchanged_j,
                slave.exchanged_j);
  }
}

TEST(LongRun, SessionIsRepeatedUntilTheEnd) {
  const LoadedScene once = load_scene("demo"), many = repeated(once, 100);
  EXPECT_EQ(many.scene.duration_s(), 100);
  EXPECT_EQ(many.scene.master().therapist().intended_size(), 6 * once.scene.master().therapist().intended_size());
}

// Of the hours after the first, in which the sides engage and the hand is put in, each is like the others.
void expect_nothing_grows(const std::vector<Stretch>& all, double stretch_s, std::size_t warm_up) {
  const Stretch& first = all[warm_up];
  std::uint64_t resident_max = 0;
  for (std::size_t k = warm_up; k < all.size(); ++k) {
    const Stretch& s = all[k];
    EXPECT_NEAR(s.engaged_s, stretch_s, 0.01) << k;
    EXPECT_NEAR(s.tracking_rms_rad, first.tracking_rms_rad, 0.02 * first.tracking_rms_rad) << k;
    EXPECT_LE(s.tracking_peak_rad, 1.2 * first.tracking_peak_rad) << k;
    EXPECT_NEAR(s.force_error_rms_nm, first.force_error_rms_nm, 0.02 * first.force_error_rms_nm) << k;
    EXPECT_LE(s.force_error_peak_nm, 1.2 * first.force_error_peak_nm) << k;
    EXPECT_LE(std::fabs(s.energy_residual_master_j), s.energy_rounding_master_j) << k;
    EXPECT_LE(std::fabs(s.energy_residual_slave_j), s.energy_rounding_slave_j) << k;
    // What rounding may leave grows with the time of day (energy_audit.hpp); what it leaves does not.
    const double hours = std::max(1.0, s.until_s / 3600);
    EXPECT_LE(s.energy_rounding_master_j + s.energy_rounding_slave_j, 1e-10 * hours * s.energy_exchanged_j) << k;
    EXPECT_LE(std::fabs(s.energy_residual_master_j), 1e-11 * s.energy_exchanged_j) << k;
    EXPECT_LE(std::fabs(s.energy_residual_slave_j), 1e-11 * s.energy_exchanged_j) << k;
    EXPECT_EQ(s.not_finite, 0u);
    resident_max = std::max(resident_max, s.resident_bytes);
  }
  if (!kCounterIsBlind) {  // a sanitizer keeps books of its own
    EXPECT_LE(resident_max, first.resident_bytes + (1u << 20));
  }
}

TEST(LongRun, MinutesLookLikeEachOther) {
  const LoadedScene loaded = repeated(load_scene("demo"), 37 * 8);
  const std::vector<Stretch> all = endured(loaded, 37 * 2);  // whole sessions, so that each stretch asks the same
  for (const Stretch& s : all) {
    std::printf(
        "%6.0f s  tracking %.4g mrad  force %.4g N m  residual %.2g %.2g J, may be %.2g %.2g J, of %.3g J  "
        "late %llu\n",
        s.until_s, 1e3 * s.tracking_rms_rad, s.force_error_rms_nm, s.energy_residual_master_j,
        s.energy_residual_slave_j, s.energy_rounding_master_j, s.energy_rounding_slave_j, s.energy_exchanged_j,
        static_cast<unsigned long long>(s.late));
  }
  ASSERT_EQ(all.size(), 4u);
  expect_nothing_grows(all, 37 * 2, 1);
}

TEST(NightlyLongRun, ADayOfTheDemoGrowsInNothing) {
  const double hour_s = 3607.5;  // 195 sessions of 18.5 s
  const std::vector<Stretch> all = endured(repeated(load_scene("demo"), 24 * hour_s), hour_s);
  ASSERT_EQ(all.size(), 24u);
  double wall_s = 0;
  for (const Stretch& s : all) {
    wall_s += s.wall_s;
    std::printf(
        "%6.0f s  tracking %.5g mrad  force %.5g N m  residual %.2g %.2g J, may be %.2g %.2g J, of %.4g J  "
        "%.2f MiB  %.1f s\n",
        s.until_s, 1e3 * s.tracking_rms_rad, s.force_error_rms_nm, s.energy_residual_master_j,
        s.energy_residual_slave_j, s.energy_rounding_master_j, s.energy_rounding_slave_j, s.energy_exchanged_j,
        static_cast<double>(s.resident_bytes) / 1048576.0, s.wall_s);
  }
  std::printf("24 h of virtual time in %.0f s\n", wall_s);
  expect_nothing_grows(all, hour_s, 1);
}

}  // namespace
}  // namespace farhand
