// What is said of a scene at load: on both sides of each bound, and that what is called unstable is, and nothing else.
#include "common/advice/warnings.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "common/advice/scene_loops.hpp"
#include "common/config/load.hpp"
#include "common/config/schema.hpp"
#include "common/link/packet.hpp"
#include "netem/lab/simulation.hpp"
#include "tests/support/said_at_load.hpp"

namespace farhand {
namespace {

TEST(Warnings, ShippedScenesAreWarnedOfOnlyWhereTheyDeserveIt) {
  for (const std::string& name : known_scenes()) {
    const LoadedScene loaded = load_scene(name);
    if (name != "thesis_table_5_1") {
      EXPECT_EQ(said(loaded), "") << name;
      continue;
    }
    const Sets warned = warnings(loaded.scene);
    ASSERT_EQ(warned.size(), 2u);  // its own comment says so
    EXPECT_EQ(
        warned[0],
        "master.motor.encoder_counts_per_rev = 20000 and slave.motor.encoder_counts_per_rev = 20000 leave 0.0857 N "
        "m RMS in the torque of the master through control.g_dis_rad_s = 1000, control.g_reac_rad_s = 1000 and "
        "control.g_v_rad_s = 500, more than 0.05; 1.71 times as many counts would do");
  }
}

// A scene that nothing can be said of: direct drive, moved to 0.1 rad and held there.
const std::string kBase = R"(
architecture: FOUR_CHANNEL
duration_s: 20
master { therapist { intended { duration_s: 2 } intended { duration_s: 1 ramp_to_rad: 0.1 } } }
operator_acts { at_s: 0.2 act: ENGAGE }
)";

struct Bound {
  const char* what;
  Sets around;               // what both sides of the bound share
  std::string within, over;  // one setting more
  const char* sentence;      // how a warning over it begins
};

const Bound kBounds[] = {
    {"DOB",
     {"master.axis.J_n_kgm2=0.012", "control.K_f_per_kgm2=0"},
     "control.g_dis_rad_s=3000",
     "control.g_dis_rad_s=6500",
     "the loop of the master is unstable in the therapist's hand: in 1 ms"},
    {"DOB of the slave, free",
     {"slave.axis.J_n_kgm2=0.012", "control.K_f_per_kgm2=0"},
     "control.g_dis_rad_s=1000",
     "control.g_dis_rad_s=3000",
     "the loop of the slave is unstable in free motion: in 1 ms"},
    {"force gain on the hand",
     {"slave.hand={stiffness_nm_per_rad: 5}"},
     "control.K_f_per_kgm2=1100",
     "control.K_f_per_kgm2=1250",
     "the loop of the slave is unstable in contact with slave.hand.stiffness_nm_per_rad = 5"},
    {"force gain on a wall",
     {"slave.wall={stiffness_nm_per_rad: 1000}"},
     "control.K_f_per_kgm2=570",
     "control.K_f_per_kgm2=600",
     "the loop of the slave is unstable in contact with slave.wall.stiffness_nm_per_rad ="},
    {"hits on a wall",
     {"slave.wall={}"},
     "control.K_f_per_kgm2=390",
     "control.K_f_per_kgm2=400",
     "a hit does not die out in contact with slave.wall.stiffness_nm_per_rad = 1000: the slave hammers on; it would be "
     "stable with control.K_f_per_kgm2 = 400 at most 395, or with slave.axis.J_n_kgm2 = 0.004 at most 0.00396"},
    {"hits on a harder wall, as damped",
     {"slave.wall={stiffness_nm_per_rad: 1e5 damping_nms_per_rad: 4}"},
     "control.K_f_per_kgm2=390",
     "control.K_f_per_kgm2=400",
     "a hit does not die out in contact with slave.wall.stiffness_nm_per_rad = 1e5: the slave hammers on"},
    {"hits, J_n high",
     {"slave.wall={}", "control.K_f_per_kgm2=280"},
     "slave.axis.J_n_kgm2=0.0052",
     "slave.axis.J_n_kgm2=0.0054",
     "a hit does not die out in"},
    {"hits, J_n low", {"slave.wall={}", "control.K_f_per_kgm2=390"}, "slave.axis.J_n_kgm2=0.0012", "", ""},
    {"g_reac",
     {},
     "control.g_reac_rad_s=100",
     "control.g_reac_rad_s=99",
     "control.g_reac_rad_s = 99 is below half of control.g_dis_rad_s = 200"},
    {"g_dis, Nyquist",
     {},
     "control.g_dis_rad_s=300",
     "control.g_dis_rad_s=3142",
     "control.g_dis_rad_s = 3142 rad/s is above 3.14e+03 rad/s, half the sampling rate of tick_s = 0.001"},
    {"g_v, Nyquist",
     {"master.motor.encoder_counts_per_rev=0", "slave.motor.encoder_counts_per_rev=0"},
     "control.g_v_rad_s=3141",
     "control.g_v_rad_s=3142",
     "control.g_v_rad_s = 3142"},
    {"g_net, Nyquist",
     {"architecture=FOUR_CHANNEL_CDOB"},
     "control.g_net_rad_s=3141",
     "control.g_net_rad_s=3142",
     "control.g_net_rad_s = 3142"},
    {"g_net, no CDOB",
     {},
     "control.g_net_rad_s=1000",
     "control.g_net_rad_s=9999",
     "control.g_net_rad_s = 9999 has no effect: it needs architecture FOUR_CHANNEL_CDOB or FOUR_CHANNEL_CDOB_SDCV"},
    {"the other device",
     {},
     "slave.mcu.g_v_rad_s=500",
     "slave.mcu.g_v_rad_s=501",
     "slave.mcu.g_v_rad_s = 501 has no effect: it needs slave.device SERIES_ELASTIC"},
    {"MCU, Nyquist",
     {"slave.device=SERIES_ELASTIC", "control.K_f_per_kgm2=125"},
     "slave.mcu.g_v_rad_s=6283",
     "slave.mcu.g_v_rad_s=6284",
     "slave.mcu.g_v_rad_s = 6284 rad/s is above 6.28e+03 rad/s, half the sampling rate of "
     "slave.mcu.loop_hz = 2000"},
    {"encoder",
     {},
     "slave.motor.encoder_counts_per_rev=13000",
     "slave.motor.encoder_counts_per_rev=11000",
     "master.motor.encoder_counts_per_rev = 20000 and slave.motor.encoder_counts_per_rev = 11000 leave 0.053"},
    {"encoder, ideal",
     {"control.g_dis_rad_s=3000", "control.g_reac_rad_s=3000", "master.motor.encoder_counts_per_rev=0"},
     "slave.motor.encoder_counts_per_rev=0",
     "slave.motor.encoder_counts_per_rev=20000",
     "master.motor.encoder_counts_per_rev = 0 and slave.motor.encoder_counts_per_rev = 20000 leave"},
    {"f_2",
     {"architecture=FOUR_CHANNEL_CDOB_SDCV", "slave.hand={stiffness_nm_per_rad: 5}", "control.f_1_nm=0.05"},
     "control.f_2_nm=0.18",
     "control.f_2_nm=0.19",
     "control.f_2_nm = 0.19 N m is not reached in contact with slave.hand.stiffness_nm_per_rad = 5: alpha stays at"},
    {"f_2 of the patient",
     {"architecture=FOUR_CHANNEL_CDOB_SDCV", "slave.hand={stiffness_nm_per_rad: 5}", "control.f_1_nm=0.05",
      "control.f_2_nm=0.19"},
     "control.sdcv_from_patient=true",
     "control.sdcv_from_patient=false",
     "control.f_2_nm = 0.19 N m is not reached in contact with slave.hand.stiffness_nm_per_rad = 5: alpha stays at"},
    {"range of the master",
     {},
     "master.axis.range_max_rad=0.1",
     "master.axis.range_max_rad=0.09",
     "master.therapist.intended goes to 0.1 rad, beyond master.axis.range_max_rad = 0.09"},
    {"range of the slave",
     {"master.therapist.intended[1].ramp_to_rad=-0.1"},
     "slave.axis.range_min_rad=-0.1",
     "slave.axis.range_min_rad=-0.09",
     "master.therapist.intended goes to -0.1 rad, beyond slave.axis.range_min_rad"},
    {"stop of the slave",
     {},
     "slave.motor.stop_max_rad=0.1",
     "slave.motor.stop_max_rad=0.05",
     "master.therapist.intended goes to 0.1 rad, beyond slave.motor.stop_max_rad = 0.05"},
    {"stop of the orthosis",
     {"slave.device=SERIES_ELASTIC", "control.K_f_per_kgm2=125"},
     "slave.series_elastic.stop_max_rad=0.1",
     "slave.series_elastic.stop_max_rad=0.05",
     "master.therapist.intended goes to 0.1 rad, beyond slave.series_elastic.stop_max_rad = 0.05"},
    {"speed of the orthosis",
     {"slave.device=SERIES_ELASTIC", "control.K_f_per_kgm2=125"},
     "slave.series_elastic.motor_speed_limit_rad_s=0.19",
     "slave.series_elastic.motor_speed_limit_rad_s=0.18",
     "master.therapist.intended moves at 0.188 rad/s, faster than slave.series_elastic.motor_speed_limit_rad_s = 0.18"},
    {"speed of the MCU's references",
     {"slave.device=SERIES_ELASTIC", "control.K_f_per_kgm2=125", "slave.axis.velocity_limit_rad_s=0.4"},
     "tick_s=0.002",
     "tick_s=0.0022",
     "master.therapist.intended moves at 0.188 rad/s, faster than 0.182 rad/s, to which tick_s = 0.0022 slows the MCU"},
    // K_h 3 and k 5 in series over 0.1 rad: 0.1875 N m
    {"torque of the slave",
     {"slave.hand={stiffness_nm_per_rad: 5}"},
     "slave.axis.torque_limit_nm=0.19",
     "slave.axis.torque_limit_nm=0.18",
     "slave.axis.torque_limit_nm = 0.18 N m is less than the 0.188 N m that"},
    {"torque of the master",
     {"slave.hand={stiffness_nm_per_rad: 5}"},
     "master.axis.torque_limit_nm=0.19",
     "master.axis.torque_limit_nm=0.18",
     "master.axis.torque_limit_nm = 0.18 N m is less than the 0.188 N m that"},
    {"weight",
     {"master.axis.torque_limit_nm=0.3"},
     "master.motor.gravity_nm=0.3",
     "master.motor.gravity_nm=0.31",
     "master.axis.torque_limit_nm = 0.3 N m cannot hold the weight of master.motor.gravity_nm = 0.31"},
    {"play-out, uniform",
     {"network.forward={delay_s: 0.05 jitter_s: 0.02}"},
     "receive.playout_max_s=0.04",
     "receive.playout_max_s=0.039",
     "receive.playout_max_s = 0.039 s is less than the 0.04 s over which network.forward.jitter_s = 0.02 spreads"},
    {"play-out, normal",
     {"network.backward={delay_s: 0.2 jitter_s: 0.01 distribution: NORMAL_DISTRIBUTION}"},
     "receive.playout_max_s=0.056",
     "receive.playout_max_s=0.055",
     "receive.playout_max_s = 0.055 s is less than the"},
    {"expiry",
     {"network.forward={delay_s: 0.05 jitter_s: 0.02}"},
     "receive.expiry_s=0.04",
     "receive.expiry_s=0.039",
     "receive.expiry_s = 0.039 s is less than the 0.04 s over which"},
    // 20000 ticks, 100 in a row
    {"silence",
     {},
     "network.backward.loss=0.9",
     "network.backward.loss=0.91",
     "network.backward.loss = 0.91 is above 0.906, from which a silence of receive.timeout_s = 0.1 s is to be "
     "expected"},
    {"engagement",
     {"architecture=FOUR_CHANNEL_CDOB", "network.forward.delay_s=0.3", "network.backward.delay_s=0.3"},
     "engagement.timeout_s=0.6",
     "engagement.timeout_s=0.5",
     "engagement.timeout_s = 0.5 s is less than the round trip of 0.6 s"},
    {"acts",
     {},
     "operator_acts[0].at_s=20",
     "operator_acts[0].at_s=21",
     "operator_acts[0].at_s = 21 lies after the end of the run, duration_s = 20"},
    {"grip",
     {"architecture=FOUR_CHANNEL_CDOB", "network.forward.delay_s=0.1", "network.backward.delay_s=0.1", "slave.hand={}"},
     "master.therapist.grip=NORMAL",
     "master.therapist.grip=LIGHT",
     "both sides together are unstable in contact with slave.hand.stiffness_nm_per_rad = 2: architecture "
     "FOUR_CHANNEL_CDOB over a round trip of 0.2 s, master.therapist.grip LIGHT (0.5 N m/rad); it would be stable over "
     "at most 0.04"},
};

std::ostream& operator<<(std::ostream& out, const Bound& bound) { return out << bound.what; }

class EachBound : public testing::TestWithParam<Bound> {};

TEST_P(EachBound, IsSaidOnOneSideOnly) {
  const Bound& bound = GetParam();
  const auto about = [&](const std::string& set) {
    Sets sets = bound.around;
    sets.push_back(set);
    return said(load(kBase, sets));
  };
  if (bound.over.empty()) {
    EXPECT_EQ(about(bound.within), "");
    return;
  }
  const std::string beginning = std::string(bound.sentence).substr(0, std::string(bound.sentence).find(" = "));
  EXPECT_EQ(about(bound.within).find(beginning), std::string::npos) << about(bound.within);
  EXPECT_NE(about(bound.over).find(bound.sentence), std::string::npos) << about(bound.over);
}

INSTANTIATE_TEST_SUITE_P(Warnings, EachBound, testing::ValuesIn(kBounds), [](const auto& tested) {
  std::string name = tested.param.what;
  std::erase_if(name, [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); });
  return name;
});

TEST(Warnings, ABaseSceneHasNone) { EXPECT_EQ(said(load(kBase)), ""); }

// Path and value of every number of a scene at an end of its range, or next to it where the end is not allowed.
void at_the_ends(const google::protobuf::Descriptor& message, const std::string& prefix, Sets& sets) {
  for (int i = 0; i < message.field_count(); ++i) {
    const auto& field = *message.field(i);
    if (field.is_repeated()) continue;
    if (field.message_type() != nullptr) {
      at_the_ends(*field.message_type(), prefix + field.name() + ".", sets);
    } else if (field.cpp_type() == google::protobuf::FieldDescriptor::CPPTYPE_DOUBLE) {
      const scene::FieldInfo& info = field_info(field);
      for (const double value : {info.min(), 1e-300, 1e-12, 1e-6, info.max()})
        if (value >= info.min() && value <= info.max()) sets.push_back(prefix + field.name() + "=" + shortest(value));
    }
  }
}

TEST(Warnings, EveryFieldMayStandAtItsEnd) {
  Sets ends;
  at_the_ends(*scene::Scene::descriptor(), "", ends);
  ASSERT_GT(ends.size(), 200u);
  int loaded = 0;
  for (const char* base : {"architecture=FOUR_CHANNEL_CDOB_SDCV", "slave.device=SERIES_ELASTIC"})
    for (const std::string& end : ends) {
      try {
        for (const std::string& warning :
             warnings(load(kBase, {base, "network.forward.delay_s=0.1", "slave.wall={}", end}).scene)) {
          EXPECT_EQ(warning.find("nan"), std::string::npos) << end << ": " << warning;
          EXPECT_EQ(warning.find("inf"), std::string::npos) << end << ": " << warning;
        }
        ++loaded;
      } catch (const ConfigError&) {  // an end that another setting forbids
      }
    }
  EXPECT_GT(loaded, 300);
}

// A fixed generator and its own transform: the same scenes everywhere.
class Draw {
 public:
  explicit Draw(std::uint64_t seed) : state_(seed) {}
  double from(double low, double high) {  // on a scale of ratios
    state_ = state_ * 6364136223846793005u + 1442695040888963407u;
    return low * std::pow(high / low, static_cast<double>(state_ >> 11) * 0x1p-53);
  }

 private:
  std::uint64_t state_;
};

// Does motion not die out after the ramp? The speeds of the last 2 s against those 8 s earlier.
bool keeps_moving(const LoadedScene& loaded) {
  const Session session = simulate(loaded);
  const auto moved = [&](double from, double until) {  // speeds, of both sides
    double low = 0, high = 0;
    for (const auto* side : {&session.master, &session.slave})
      for (const StationSample& s : *side)
        if (s.t_s >= from && s.t_s <= until) low = std::min(low, s.true_v_rad_s), high = std::max(high, s.true_v_rad_s);
    return high - low;
  };
  // What explodes meets a stop, or makes a side let go, and may rest there.
  constexpr double kFar = 0.5;  // rad/s; the ramp takes 0.02
  const double end = loaded.scene.duration_s();
  if (moved(6, end) > kFar || session.master.back().state != static_cast<int>(StationState::kEngaged)) return true;
  const double late = moved(end - 2, end), before = moved(end - 10, end - 8);
  return late > 1e-7 && late > 0.5 * before;
}

// Growth between these rates is too slow to be judged by looking.
bool marginal(const scene::Scene& scene) {
  constexpr double kRate = 0.4;  // 1/s
  const double dt = scene.tick_s();
  const auto near_one = [&](double radius) { return std::abs(std::log(radius)) < kRate * dt; };
  bool sides_rest = spectral_radius(master_loop(scene)) < 1.0;
  bool near = near_one(spectral_radius(master_loop(scene)));
  for (const Contact& contact : contacts(scene)) {
    near = near || near_one(slave_radius(scene, contact));
    sides_rest = sides_rest && slave_radius(scene, contact) < 1.0;
  }
  if (near || !sides_rest) return near;
  for (const Contact& contact : contacts(scene)) {
    const Teleoperator whole = teleoperator(scene, contact);
    near = near || growing_motions(whole, std::exp(kRate * dt)) != growing_motions(whole, std::exp(-kRate * dt));
  }
  return near;
}

std::string drawn_scene(Draw& draw, int i) {
  const double hand = i % 4 == 0 ? 0.0 : draw.from(0.3, 50), grip = draw.from(0.2, 20);
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text << "architecture: " << (i % 2 == 0 ? "FOUR_CHANNEL" : "FOUR_CHANNEL_CDOB") << "\nduration_s: 30\n"
       << "control { K_f_per_kgm2: " << draw.from(30, 1500) << " g_dis_rad_s: " << draw.from(50, 1000)
       << " g_reac_rad_s: " << draw.from(50, 1000) << " local_model: " << (i % 3 == 0 ? "WITH_FORCE" : "THESIS")
       << " }\n"
       << "master { axis { J_n_kgm2: " << draw.from(0.002, 0.012)
       << " torque_rate_limit_nm_per_s: 1e6 torque_limit_nm: "
       << "100 } motor { encoder_counts_per_rev: 0 stop_min_rad: -7 stop_max_rad: 7 } therapist { grip: CUSTOM "
       << "K_h_nm_per_rad: " << grip << " B_h_nms_per_rad: " << 0.018 * grip
       << " intended { duration_s: 4 } intended { duration_s: 1 ramp_to_rad: 0.01 } } }\n"
       << "slave { axis { J_n_kgm2: " << draw.from(0.002, 0.012) << " torque_rate_limit_nm_per_s: 1e6 torque_limit_nm: "
       << "100 } motor { encoder_counts_per_rev: 0 stop_min_rad: -7 stop_max_rad: 7 } ";
  if (hand > 0) text << "hand { stiffness_nm_per_rad: " << hand << " }";
  const double delay = draw.from(0.002, 0.3);
  text << " }\noperator_acts { at_s: 0.5 act: ENGAGE }\n";
  text << "network {";
  for (const char* way : {"forward", "backward"})
    text << ' ' << way << " { delay_s: " << delay << " distribution: CONSTANT }";
  text << " }\n";
  return text.str();
}

void check_drawn_scenes(int scenes, std::uint64_t seed, int at_least) {
  Draw draw(seed);
  int stable = 0, unstable = 0;
  for (int i = 0; i < scenes; ++i) {
    const std::string text = drawn_scene(draw, i);
    const LoadedScene loaded = load(text);
    if (marginal(loaded.scene)) continue;
    // With a hand, free motion is judged as well, but not met here.
    const std::string all = said(loaded);
    const bool met = all.find("unstable in the therapist") != std::string::npos ||
                     all.find(loaded.scene.slave().has_hand() ? "unstable in contact" : "unstable in free motion") !=
                         std::string::npos;
    EXPECT_EQ(keeps_moving(loaded), met) << text << all;
    ++(met ? unstable : stable);
  }
  EXPECT_GE(stable, at_least);
  EXPECT_GE(unstable, at_least);
}

TEST(Warnings, WhatIsCalledUnstableIsAndNothingElse) { check_drawn_scenes(16, 1, 3); }
TEST(NightlyWarnings, WhatIsCalledUnstableIsAndNothingElse) { check_drawn_scenes(400, 2, 80); }

TEST(Warnings, AlphaRestsWhereTheSteadyStateSays) {
  for (const char* f_2 : {"0.12", "0.2", "0.3", "0.5"}) {
    Sets sets{"architecture=FOUR_CHANNEL_CDOB_SDCV", "slave.hand={stiffness_nm_per_rad: 5}", "control.f_1_nm=0.05",
              "network.forward.delay_s=0.05",        "network.backward.delay_s=0.05",        "duration_s=30"};
    sets.push_back(std::string("control.f_2_nm=") + f_2);
    const LoadedScene loaded = load(kBase, sets);
    const Contact hand = contacts(loaded.scene).back();
    EXPECT_NEAR(simulate(loaded).master.back().alpha, alpha_in(loaded.scene, hand), 0.02) << f_2;
    sets.push_back("control.sdcv_from_patient=true");
    const LoadedScene named = load(kBase, sets);
    EXPECT_EQ(alpha_in(named.scene, hand), 0.0);
    EXPECT_NEAR(simulate(named).master.back().alpha, 0.0, 0.02) << f_2;
  }
}

}  // namespace
}  // namespace farhand
