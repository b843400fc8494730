// What a scene does not need costs nothing and changes nothing: every block that can be left out is compared bit for
// bit with the same block made idle.
#include <gtest/gtest.h>

#include <bit>
#include <cstdio>

#include "common/config/json.hpp"
#include "netem/lab/explain_text.hpp"
#include "netem/lab/simulation.hpp"

namespace farhand {
namespace {

using Sets = std::vector<std::string>;

constexpr double StationSample::*kColumns[] = {
    &StationSample::t_s,         &StationSample::x_rad,        &StationSample::v_rad_s,
    &StationSample::f_nm,        &StationSample::remote_x_rad, &StationSample::remote_v_rad_s,
    &StationSample::remote_f_nm, &StationSample::target_x_rad, &StationSample::command_nm,
    &StationSample::x_cdob_rad,  &StationSample::alpha,        &StationSample::playout_delay_s,
    &StationSample::rtt_s,       &StationSample::true_x_rad,   &StationSample::true_v_rad_s,
    &StationSample::true_f_nm,
};

bool same_row(const StationSample& a, const StationSample& b, bool but_compensation) {
  bool same = a.state == b.state && a.limits == b.limits && a.newest_peer_send_ns == b.newest_peer_send_ns &&
              a.newest_peer_arrival_ns == b.newest_peer_arrival_ns;
  for (const auto column : kColumns) {
    if (but_compensation && (column == &StationSample::x_cdob_rad || column == &StationSample::alpha)) continue;
    same = same && std::bit_cast<std::uint64_t>(a.*column) == std::bit_cast<std::uint64_t>(b.*column);
  }
  return same;
}

Session run(const std::string& scene, Sets sets) {
  for (const char* window : {"windows={}", "duration_s=14"}) sets.insert(sets.begin(), window);
  return simulate(load_scene(scene, sets));
}

void expect_same_rows(const Session& a, const Session& b, bool but_compensation = false) {
  ASSERT_EQ(a.master.size(), b.master.size());
  ASSERT_EQ(a.slave.size(), b.slave.size());
  int engaged = 0;
  for (std::size_t k = 0; k < a.master.size(); ++k) {
    ASSERT_TRUE(same_row(a.master[k], b.master[k], but_compensation)) << "master at " << a.master[k].t_s << " s";
    ASSERT_TRUE(same_row(a.slave[k], b.slave[k], but_compensation)) << "slave at " << a.slave[k].t_s << " s";
    engaged += a.master[k].state == 2 && a.slave[k].state == 2;
  }
  EXPECT_GT(engaged, 5000);  // and not for want of anything happening
}

void expect_no_difference(const std::string& scene, const Sets& common, Sets without, Sets idle) {
  without.insert(without.begin(), common.begin(), common.end());
  idle.insert(idle.begin(), common.begin(), common.end());
  expect_same_rows(run(scene, without), run(scene, idle));
}

// With the smallest cut-off that a double can hold, g dt is 0 and the filter lets nothing through. At zero delay with a
// cut-off of use, the CDOB does change the numbers: its model does not know the hand, so it is not idle, only useless.
TEST(LeftOut, CdobThatLetsNothingThroughIsNoCdob) {
  for (const char* scene : {"zero_delay", "four_channel", "sea_four_channel"}) {
    expect_same_rows(run(scene, {"architecture=FOUR_CHANNEL"}),
                     run(scene, {"architecture=FOUR_CHANNEL_CDOB", "control.g_net_rad_s=5e-324"}), true);
  }
}

TEST(LeftOut, SdcvThatNeverScalesIsNoSdcv) {
  for (const char* scene : {"four_channel", "sea_four_channel", "demo"}) {
    expect_no_difference(scene, {}, {"architecture=FOUR_CHANNEL_CDOB"},
                         {"architecture=FOUR_CHANNEL_CDOB_SDCV", "control.f_1_nm=90", "control.f_2_nm=100"});
  }
}

// What a law does not contain cannot matter to it.
TEST(LeftOut, SettingsOfBlocksThatAreNotThereChangeNothing) {
  expect_no_difference("four_channel", {}, {},
                       {"control.g_net_rad_s=50", "control.local_model=WITH_FORCE", "control.f_1_nm=0.01",
                        "control.f_2_nm=0.02", "control.alpha_cutoff_rad_s=1"});
  expect_no_difference("four_channel_cdob", {}, {}, {"control.f_1_nm=0.01", "control.f_2_nm=0.02"});
}

TEST(LeftOut, OfADirectDriveTheOrthosisAndItsMcuAreNoPart) {
  expect_no_difference("four_channel_cdob_sdcv", {}, {},
                       {"slave.series_elastic={spring_nm_per_rad: 3 tendon_friction_nm: 0.5 serial_one_way_s: 0.05}",
                        "slave.mcu={loop_hz: 500 g_rad_s: 20}"});
  expect_no_difference("demo", {}, {}, {"slave.motor={J_kgm2: 0.1 gravity_nm: 1 encoder_counts_per_rev: 100}"});
}

// A hand that comes in later ends a piece of the motion there, also if it exerts nothing, and the same way in two
// pieces is rounded twice. So it is in from the beginning.
TEST(LeftOut, HandWithoutStiffnessAndDampingIsNoHand) {
  for (const char* scene : {"outage", "demo"}) {
    const std::string hand = "slave.hand={stiffness_nm_per_rad: 0 damping_nms_per_rad: 0 rest_rad: 0.2 from_s: 0}";
    LoadedScene without = load_scene(scene, Sets{"windows={}", "duration_s=14"});
    without.scene.mutable_slave()->clear_hand();
    expect_same_rows(simulate(without), run(scene, {hand}));
  }
}

TEST(LeftOut, WallOutOfReachIsNoWall) {
  for (const char* scene : {"four_channel_cdob_sdcv", "demo"}) {
    expect_no_difference(scene, {}, {}, {"slave.wall={at_rad: 0.9 stiffness_nm_per_rad: 2000}"});
    expect_no_difference(scene, {}, {}, {"slave.wall={at_rad: -0.9 stiffness_nm_per_rad: 2000}"});
  }
}

TEST(LeftOut, StopsOutOfReachAreNoStops) {
  expect_no_difference("four_channel", {}, {}, {"slave.motor.stop_max_rad=2", "slave.motor.stop_min_rad=-1.5"});
  expect_no_difference("demo", {}, {},
                       {"slave.series_elastic.stop_max_rad=2", "slave.series_elastic.stop_min_rad=-1.5"});
}

// Friction of 0 N m is the absence of friction; a very small one is not: its bristle settles at a rate of
// sigma |v| / F_c, so that the least friction is the stiffest.
TEST(LeftOut, FrictionOfNothingHasNoBristle) {
  expect_no_difference("sea_friction", {"slave.series_elastic.tendon_friction_nm=0"}, {},
                       {"slave.series_elastic.tendon_stiffness_nm_per_rad=3000"});
}

TEST(LeftOut, WeightOfNothingHasNoDirection) {
  expect_no_difference("four_channel_cdob", {}, {},
                       {"master.motor.gravity_angle_rad=1", "slave.motor.gravity_angle_rad=-2"});
  expect_no_difference("four_channel_cdob", {}, {},
                       {"master.axis.gravity_angle_rad=1", "slave.axis.gravity_angle_rad=-2"});
}

TEST(LeftOut, LinkWithoutJitterAndLossDrawsForNothing) {
  expect_no_difference("four_channel_cdob", {}, {},
                       {"network.forward.distribution=UNIFORM", "network.backward.distribution=NORMAL_DISTRIBUTION"});
  expect_no_difference("demo", {}, {}, {"network.forward.cut_from_s=15", "network.forward.cut_until_s=16"});
}

TEST(LeftOut, SettingsOfTheClockLoopAreNoPartOfVirtualTime) {
  expect_no_difference("demo", {}, {}, {"runtime={priority: 0 lock_memory: true}"});
}

// Keeps a checksum of everything that a row holds, and nothing else.
class Checksum final : public Witness {
 public:
  void ticked(bool, const Side& side, double t_s, OperatorAct) override {
    const Truth truth = side.truth();
    for (const double value :
         {t_s, side.trace().local.x[0], side.trace().target.x[0], side.trace().effort, truth.x, truth.v, truth.f})
      add(value);
  }
  void add(double value) { sum = (sum ^ std::bit_cast<std::uint64_t>(value)) * 0x100000001B3u; }
  std::uint64_t sum = 0xCBF29CE484222325u;
};

TEST(LeftOut, RowsThatNobodyKeepsAreTheSameRows) {
  const LoadedScene loaded = load_scene("demo");
  Checksum live, kept;
  const RunCounters counters = simulate(loaded, make_sides(loaded.scene), live);
  const Session session = simulate(loaded);
  for (std::size_t k = 0; k < session.master.size(); ++k) {
    for (const StationSample* row : {&session.master[k], &session.slave[k]}) {
      for (const double value : {row->t_s, row->x_rad, row->target_x_rad, row->command_nm, row->true_x_rad,
                                 row->true_v_rad_s, row->true_f_nm})
        kept.add(value);
    }
  }
  EXPECT_EQ(live.sum, kept.sum);
  EXPECT_EQ(counters.slave.received, session.slave_counters.received);
}

const Block& block(const Explanation& explanation, Place place, BlockId id) {
  for (const Block& one : explanation.blocks) {
    if (one.place == place && one.id == id) return one;
  }
  throw std::out_of_range("no such block");
}

const Block& law_block(const Explanation& explanation, Place place, const std::string& name) {
  for (const Block& one : explanation.blocks) {
    if (one.place == place && one.id == BlockId::kLawBlock && one.name == name) return one;
  }
  throw std::out_of_range("no block " + name);
}

Explanation explained(const std::string& scene, const Sets& sets = {}) {
  return explain_without_costs(load_scene(scene, sets));
}

// Everything that the wall clock measured, away.
Json without_wall_clock(const Json& value) {
  if (!value.is_object() && !value.is_array()) return value;
  Json left = value.is_array() ? Json::array() : Json::object();
  for (std::size_t i = 0; value.is_array() && i < value.size(); ++i) left.push_back(without_wall_clock(value[i]));
  for (const std::string& key : value.keys())
    if (key != "wall_clock") left.set(key, without_wall_clock(value[key]));
  return left;
}

TEST(Explain, SaysOfEveryShippedSceneWhatItHasAndWhatItLeavesOut) {
  for (const std::string& name : known_scenes()) {
    const LoadedScene loaded = load_scene(name);
    const Explanation e = explain(loaded);
    for (const Block& one : e.blocks) {
      EXPECT_FALSE(one.reason.empty()) << name << ' ' << one.name;
      if (one.bytes > 0) {
        EXPECT_TRUE(std::isfinite(one.cost.ns_per_tick)) << name << ' ' << one.name;
      }
    }
    for (const Cost& cost : {e.master_station, e.slave_station, e.master_side, e.slave_side, e.run})
      EXPECT_GT(cost.ns_per_tick, 10) << name;
    EXPECT_GT(e.master_station_bytes, sizeof(Receiver<1>));
    EXPECT_EQ(without_wall_clock(Json::parse(json_text(e))),
              without_wall_clock(Json::parse(json_text(explain_without_costs(loaded)))))
        << name;
  }
}

TEST(Explain, BlocksAreThoseOfTheArchitecture) {
  for (const auto& [architecture, cdob, sdcv, mediator] : {std::tuple{"FOUR_CHANNEL", false, false, false},
                                                           {"FOUR_CHANNEL_CDOB", true, false, false},
                                                           {"FOUR_CHANNEL_CDOB_SDCV", true, true, false},
                                                           {"MODEL_MEDIATED", false, false, true}}) {
    const Explanation e = explained("four_channel", {std::string("architecture=") + architecture});
    EXPECT_EQ(law_block(e, Place::kMaster, "CDOB").contained, cdob);
    EXPECT_EQ(law_block(e, Place::kMaster, "SDCV").contained, sdcv);
    EXPECT_EQ(law_block(e, Place::kMaster, "mediator").contained, mediator);
    EXPECT_FALSE(law_block(e, Place::kSlave, "mediator").contained);
    EXPECT_FALSE(law_block(e, Place::kSlave, "CDOB").contained);
    EXPECT_TRUE(block(e, Place::kSlave, BlockId::kGuard).contained);
    EXPECT_FALSE(block(e, Place::kMaster, BlockId::kGuard).contained);
  }
}

TEST(Explain, WarnsOfABlockThatTheSceneDoesNotNeed) {
  const auto law_needless = [](const char* scene, const Sets& sets, const char* name) {
    return law_block(explained(scene, sets), Place::kMaster, name).needless;
  };
  const auto needless = [](const char* scene, const Sets& sets, Place place, BlockId id) {
    return block(explained(scene, sets), place, id).needless;
  };
  EXPECT_NE(law_needless("zero_delay", {"architecture=FOUR_CHANNEL_CDOB"}, "CDOB").find("FOUR_CHANNEL"),
            std::string::npos);
  EXPECT_EQ(law_needless("four_channel_cdob", {}, "CDOB"), "");
  EXPECT_NE(law_needless("outage", {}, "SDCV").find("nothing to touch"), std::string::npos);
  EXPECT_EQ(law_needless("demo", {}, "SDCV"), "");
  // 0.4 N m/rad at 0.3 rad is less than f_1 = 0.2 N m.
  EXPECT_NE(law_needless("demo", {"slave.hand.stiffness_nm_per_rad=0.4"}, "SDCV").find("0.12 N m"), std::string::npos);
  EXPECT_NE(needless("demo", {"slave.hand={stiffness_nm_per_rad: 0 damping_nms_per_rad: 0}"}, Place::kWorldSlave,
                     BlockId::kHand),
            "");
  EXPECT_NE(needless("demo", {"slave.wall={at_rad: 0.9}"}, Place::kWorldSlave, BlockId::kWall), "");
  EXPECT_EQ(needless("demo", {"slave.wall={at_rad: 0.2}"}, Place::kWorldSlave, BlockId::kWall), "");
}

// What AUTO takes, and the numbers behind it.
TEST(Explain, IntegratorComesWithItsStiffnessEstimate) {
  const auto choice = [](const char* scene, const Sets& sets) { return explained(scene, sets).plants.at(1); };
  const PlantChoice affine = choice("demo", {});
  EXPECT_EQ(affine.method, "closed form");
  EXPECT_NE(affine.because.find("affine"), std::string::npos);
  EXPECT_NEAR(affine.rate_times_step, affine.largest_rate_per_s * affine.step_s, 1e-12);
  const PlantChoice friction = choice("sea_friction", {});
  EXPECT_EQ(friction.method, "RK4");
  EXPECT_LT(friction.rate_times_step, friction.limit);
  const PlantChoice stiff = choice("sea_friction", {"slave.wall={stiffness_nm_per_rad: 1e8 damping_nms_per_rad: 0}"});
  EXPECT_EQ(stiff.method, "SDIRK2");
  EXPECT_GT(stiff.rate_times_step, stiff.limit);
  EXPECT_TRUE(block(explained("sea_friction", {"slave.wall={stiffness_nm_per_rad: 1e8 damping_nms_per_rad: 0}"}),
                    Place::kWorldSlave, BlockId::kStiff)
                  .contained);
  EXPECT_EQ(choice("demo", {"world.method=RK4"}).because.find("world.method asks for it"), 0u);
}

TEST(Explain, ReasonsAreMadeOfTheScenesOwnValues) {
  const Explanation e = explained("demo", {"network.forward.delay_s=0.25"});
  EXPECT_NE(law_block(e, Place::kMaster, "CDOB").reason.find("350 ms"), std::string::npos);
  EXPECT_NE(block(e, Place::kLink, BlockId::kLoss).reason.find("1 %"), std::string::npos);
  EXPECT_NE(law_block(explained("zero_delay"), Place::kMaster, "CDOB").reason.find("no delay"), std::string::npos);
  EXPECT_NE(block(explained("sea_friction"), Place::kWorldSlave, BlockId::kFriction).reason.find("0.05"),
            std::string::npos);
}

}  // namespace
}  // namespace farhand
