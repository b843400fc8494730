// Scene files: what loads, what is refused and with which words; the schema printout.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>

#include "common/config/json.hpp"
#include "common/config/load.hpp"
#include "common/config/schema.hpp"
#include "common/config/world_params.hpp"
#include "tests/support/complaint.hpp"

namespace farhand {
namespace {

std::string read_file(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

struct SceneDirectory {
  explicit SceneDirectory(const std::string& path) { setenv("FARHAND_SCENES", path.c_str(), 1); }
  ~SceneDirectory() { unsetenv("FARHAND_SCENES"); }
};

TEST(ShippedScenes, AllLoadAndSayWhatTheyAre) {
  ASSERT_GE(known_scenes().size(), 12u);
  for (const std::string& name : known_scenes()) {
    const LoadedScene loaded = load_scene(name);
    EXPECT_EQ(loaded.name, name);
    EXPECT_FALSE(loaded.scene.description().empty()) << name;
    EXPECT_GT(loaded.scene.operator_acts_size(), 0) << name << " never engages";
  }
}

TEST(ShippedScenes, IntendedMotionEndsWithinTheRunAndHandComesAtRest) {
  for (const std::string& name : known_scenes()) {
    const scene::Scene scene = load_scene(name).scene;
    double t_s = 0;
    for (const auto& movement : scene.master().therapist().intended()) {
      if (movement.has_sine_amplitude_rad()) {
        const double periods = movement.duration_s() * movement.sine_frequency_hz();
        EXPECT_NEAR(periods, std::round(periods), 1e-9) << name << ": the sine must end where it began";
        EXPECT_TRUE(!scene.slave().has_hand() || scene.slave().hand().from_s() <= t_s ||
                    scene.slave().hand().from_s() >= t_s + movement.duration_s())
            << name << ": the hand comes in while the orthosis moves";
      }
      t_s += movement.duration_s();
    }
    EXPECT_LE(t_s, scene.duration_s()) << name;
  }
}

TEST(Load, FillsInEveryDefault) {
  const scene::Scene scene = load_text(kBase);
  EXPECT_EQ(scene.control().k_p_per_s2(), 400);
  EXPECT_EQ(scene.slave().axis().range_max_rad(), 0.349);
  EXPECT_EQ(scene.master().therapist().grip(), scene::NORMAL);
  EXPECT_EQ(scene.world().step_s(), 50e-6);
  EXPECT_EQ(scene.network().backward().distribution(), scene::UNIFORM);
  EXPECT_EQ(scene.seed(), 1u);
  EXPECT_TRUE(scene.has_description());
  EXPECT_FALSE(scene.slave().has_hand());
  EXPECT_FALSE(scene.slave().has_wall());
  EXPECT_FALSE(scene.windows().has_free());
  EXPECT_FALSE(scene.windows().has_contact());
  EXPECT_EQ(load_text(kBase + "slave { hand {} }").slave().hand().stiffness_nm_per_rad(), 2);
}

// What a scene does not name is not in its world.
TEST(Load, FrictionAndTheEndOfTheSpringAreAbsentUnlessNamed) {
  const scene::Scene scene = load_text(kBase + "slave { device: SERIES_ELASTIC }");
  EXPECT_EQ(world_numerics(scene).method, Method::kAuto);
  EXPECT_EQ(master_world_params(scene).motor.friction(), Friction::kNone);
  EXPECT_EQ(series_elastic_world_params(scene).friction(), Friction::kNone);
  EXPECT_EQ(series_elastic_world_params(scene).actuator.spring_range, 0);
  const scene::Scene rough =
      load_text(kBase +
                "master { motor { coulomb_nm: 0.1 } } slave { motor { lugre {} } series_elastic { tendon_friction_nm: "
                "0.05 spring_range_rad: 0.2 } } world { method: SDIRK2 rtol: 1e-6 }");
  EXPECT_EQ(master_world_params(rough).motor.coulomb, 0.1);
  EXPECT_EQ(direct_slave_world_params(rough).motor.bristle->F_s, 0.07);
  EXPECT_EQ(series_elastic_world_params(rough).actuator.tendon->sigma_0, 20);
  EXPECT_EQ(series_elastic_world_params(rough).actuator.tendon->F_s, 0.05);
  EXPECT_EQ(series_elastic_world_params(rough).actuator.spring_range, 0.2);
  EXPECT_EQ(world_numerics(rough).method, Method::kSdirk2);
  EXPECT_EQ(world_numerics(rough).settings.rtol, 1e-6);
}

TEST(Load, OneFrictionAtOnePlace) {
  EXPECT_EQ(complaint(kBase + "master { motor { coulomb_nm: 0.1 lugre {} } }"),
            "FILE:3:34: master.motor.lugre and coulomb_nm = 0.1 are two frictions at one place; give one");
  EXPECT_EQ(complaint(kBase + "slave { series_elastic { tendon_friction_nm: 0.1 tendon_lugre {} } }"),
            "FILE:3:50: slave.series_elastic.tendon_lugre and tendon_friction_nm = 0.1 are two frictions at one place; "
            "give one");
  EXPECT_EQ(complaint(kBase + "slave { motor { lugre { F_c_nm: 0.1 } } }"),
            "FILE:3:25: slave.motor.lugre.F_c_nm = 0.1 must be at most F_s_nm = 0.07");
}

TEST(Load, EveryDefaultOfTheSchemaIsItselfAllowed) {
  // A completed scene is checked again when it is loaded from its own text.
  EXPECT_EQ(complaint(complete_text(
                load_text(kBase + "slave { hand {} wall {} } master { therapist { intended { duration_s: 1 } } }"))),
            "");
}

TEST(Load, SaysWhatIsMissing) {
  EXPECT_EQ(complaint("architecture: FOUR_CHANNEL"),
            "FILE: duration_s is missing and has no default; give a value from 0.1 to 1e6 s (length of the run)");
  EXPECT_EQ(
      complaint(kBase + "windows {\n  free { from_s: 1 }\n}"),
      "FILE:4:3: windows.free.until_s is missing and has no default; give a value from 0 to 1e9 s (end of the window)");
  EXPECT_EQ(complaint(""),
            "FILE: architecture is missing and has no default; give one of FOUR_CHANNEL, FOUR_CHANNEL_CDOB, "
            "FOUR_CHANNEL_CDOB_SDCV, MODEL_MEDIATED, TWO_CHANNEL, WAVE, "
            "FOUR_CHANNEL_TANK, AUTOMATIC, TWO_CHANNEL_PO_PC (which control architecture runs)\n"
            "FILE: duration_s is missing and has no default; give a value from 0.1 to 1e6 s (length of the run)");
}

TEST(Load, SaysWhichFieldWasMeant) {
  EXPECT_EQ(complaint(kBase + "control {\n  K_p_per_s: 3\n}"),
            "FILE:4:3: there is no field 'K_p_per_s' in Control, did you mean 'K_p_per_s2'?");
  EXPECT_EQ(complaint(kBase + "slave { hand { stiffness: 3 } }"),
            "FILE:3:16: there is no field 'stiffness' in Hand, did you mean 'stiffness_nm_per_rad'?");
  EXPECT_EQ(complaint(kBase + "entirely_else: 3"), "FILE:3:1: there is no field 'entirely_else' in Scene");
  EXPECT_EQ(complaint("architecture: FIVE_CHANNEL\nduration_s: 10\n"),
            "FILE:1:15: architecture cannot be 'FIVE_CHANNEL'; give one of FOUR_CHANNEL, FOUR_CHANNEL_CDOB, "
            "FOUR_CHANNEL_CDOB_SDCV, MODEL_MEDIATED, TWO_CHANNEL, WAVE, "
            "FOUR_CHANNEL_TANK, AUTOMATIC, TWO_CHANNEL_PO_PC");
}

TEST(Load, SaysWhatIsOutOfRange) {
  const std::string range = " is not allowed; give a value from 0 to 1e6 1/s2 (position gain of C_p(s) = K_d s + K_p)";
  for (const std::string value : {"-1", "nan", "inf", "-inf", "1000001"})
    EXPECT_EQ(complaint(kBase + "control { K_p_per_s2: " + value + " }"),
              "FILE:3:11: control.K_p_per_s2 = " + shortest(std::stod(value)) + range);
  EXPECT_EQ(complaint(kBase + "control { K_p_per_s2: 1e6 }"), "");
  EXPECT_EQ(complaint(kBase + "control { K_p_per_s2: 0 }"), "");
  EXPECT_EQ(complaint(kBase + "control { g_dis_rad_s: 0 }"),
            "FILE:3:11: control.g_dis_rad_s = 0 is not allowed; give a value above 0, up to 1e5 rad/s (cut-off of the "
            "disturbance observer)");
  EXPECT_EQ(complaint(kBase + "runtime { priority: 1.5 }"),
            "FILE:3:11: runtime.priority = 1.5 is not allowed; give a whole number from 0 to 99 (SCHED_FIFO "
            "priority of the loop "
            "thread; 0: ordinary scheduling)");
  EXPECT_EQ(complaint(kBase + "seed: 9007199254740993"),
            "FILE:3:1: seed = 9007199254740993 is not allowed; give a whole number from 0 to 9007199254740992 (seeds "
            "every random choice of the run)");
  EXPECT_EQ(complaint(kBase + "operator_acts { at_s: 1 act: 0 }"),
            "FILE:3:25: operator_acts[0].act must be one of ENGAGE, HOLD, STOP, RESET, HOME, IDENTIFY, SWEEP");
  EXPECT_EQ(complaint(kBase + "operator_acts { at_s: 1 act: 17 }"),
            "FILE:3:25: operator_acts[0].act must be one of ENGAGE, HOLD, STOP, RESET, HOME, IDENTIFY, SWEEP");
}

TEST(Load, CollectsEveryMistake) {
  EXPECT_EQ(
      complaint("architecture: FOUR_CHANNEL\nduration_s: -1\nspeed: 3\ntick_s: 1\nnetwork { forward { los: 0.1 } }\n"),
      "FILE:3:1: there is no field 'speed' in Scene, did you mean 'seed'?\n"
      "FILE:5:21: there is no field 'los' in Path, did you mean 'loss'?\n"
      "FILE:2:1: duration_s = -1 is not allowed; give a value from 0.1 to 1e6 s (length of the run)\n"
      "FILE:4:1: tick_s = 1 is not allowed; give a value from 1e-4 to 0.02 s (control period of both stations)");
}

TEST(Load, RefusesWhatIsGivenTwice) {
  EXPECT_EQ(complaint(kBase + "duration_s: 5"), "FILE:3:1: duration_s is given twice");
  EXPECT_EQ(complaint(kBase + "control { K_p_per_s2: 1 }\ncontrol { K_d_per_s: 1 }"),
            "FILE:4:1: control is given twice");
  EXPECT_EQ(complaint(kBase + "slave { hand {} hand {} }"), "FILE:3:17: hand is given twice");
  EXPECT_EQ(complaint(kBase, {"slave.hand={ rest_rad: 0 rest_rad: 0.1 }"}),
            "--set slave.hand={ rest_rad: 0 rest_rad: 0.1 }: rest_rad is given twice");
}

TEST(Load, RefusesWhatIsNotASceneFile) {
  EXPECT_EQ(complaint("\x7f"
                      "ELF\x02\x01"),
            "FILE: is not text: it holds control characters");
  EXPECT_EQ(complaint(kBase + "description: \"\xff\xfe\""), "FILE: is not UTF-8 text");
  EXPECT_EQ(complaint(kBase + std::string(1, '\0')), "FILE: is not text: it holds control characters");
  EXPECT_EQ(complaint(kBase + "description: \"\\377\""), "FILE:3:1: description is not valid UTF-8 text");
  EXPECT_EQ(complaint(kBase + "description: \"a\\nb\""),
            "FILE:3:1: description must be one line without control characters");
  EXPECT_EQ(complaint(std::string((1u << 20) + 1, ' ')), "FILE: is larger than 1 MiB, so it is not a scene file");
  EXPECT_EQ(complaint(std::string(1u << 20, '#')),
            "FILE: architecture is missing and has no default; give one of FOUR_CHANNEL, FOUR_CHANNEL_CDOB, "
            "FOUR_CHANNEL_CDOB_SDCV, MODEL_MEDIATED, TWO_CHANNEL, WAVE, "
            "FOUR_CHANNEL_TANK, AUTOMATIC, TWO_CHANNEL_PO_PC (which control architecture runs)\n"
            "FILE: duration_s is missing and has no default; give a value from 0.1 to 1e6 s (length of the run)");
  EXPECT_EQ(complaint(kBase + "control {"), "FILE:3:10: Expected identifier, got: the end");
  EXPECT_EQ(complaint(kBase + "duration_s"), "FILE:3:1: duration_s is given twice");
  std::string wrong = kBase;
  while (wrong.size() < 1'000'000) wrong += "no_such_field: 1\n";
  EXPECT_NE(complaint(wrong).find("more mistakes"), std::string::npos);
  for (const std::string open : {"a{", "a[", "a:[{", "a<", "slave{", "[", "{"}) {
    std::string deep;
    while (deep.size() < 900'000) deep += open;
    EXPECT_NE(complaint(deep), "") << open;
  }
  const auto refusal = [](const std::string& path) -> std::string {
    try {
      load_scene(path);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refusal("/nonexistent/scene.txtpb"),
            "/nonexistent/scene.txtpb: cannot be opened: No such file or directory");
  EXPECT_EQ(refusal("/"), "/: is a directory, not a scene file");
}

TEST(Load, NamesTheKnownScenes) {
  const std::string directory = testing::TempDir() + "config_test_scenes_" + std::to_string(getpid());
  std::filesystem::create_directories(directory);
  std::ofstream(directory + "/first.txtpb") << kBase;
  std::ofstream(directory + "/second.txtpb") << kBase;
  std::ofstream(directory + "/notes.md") << "no scene";
  const SceneDirectory chosen(directory);
  EXPECT_EQ(load_scene("first").path, directory + "/first.txtpb");
  try {
    load_scene("frist");
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_EQ(error.what(),
              "there is no scene 'frist' in " + directory + ", did you mean 'first'? Known scenes: first second");
  }
  std::filesystem::remove_all(directory);
}

TEST(Load, ChecksWhatMustFitTogether) {
  EXPECT_EQ(complaint(kBase + "control { f_1_nm: 0.8 }"),
            "FILE:3:11: control.f_1_nm = 0.8 must be below f_2_nm = 0.75");
  EXPECT_EQ(complaint(kBase + "master { axis { range_min_rad: 0.4 } }"),
            "FILE:3:17: master.axis.range_min_rad = 0.4 must be below range_max_rad = 0.349");
  EXPECT_EQ(complaint(kBase + "slave { motor { stop_min_rad: 0.349 } }"),
            "FILE:3:17: slave.motor.stop_min_rad = 0.349 must be below stop_max_rad = 0.349");
  EXPECT_EQ(complaint(kBase + "slave { series_elastic { stop_max_rad: -1 } }"),
            "FILE:3:9: slave.series_elastic.stop_min_rad = -0.5236 must be below stop_max_rad = -1");
  EXPECT_EQ(complaint(kBase + "slave { hand { from_s: 3 until_s: 2 } }"),
            "FILE:3:16: slave.hand.from_s = 3 must be below until_s = 2");
  EXPECT_EQ(complaint(kBase + "slave { hand { relaxed_nm_per_rad: 3 } }"),
            "FILE:3:16: slave.hand.relaxed_nm_per_rad = 3 must be at most stiffness_nm_per_rad = 2");
  EXPECT_EQ(complaint(kBase + "master { therapist { grip: CUSTOM K_h_nm_per_rad: 0 reaction { above_nm: 1 } } }"),
            "FILE:3:53: master.therapist.reaction needs master.therapist.K_h_nm_per_rad above 0: torque is felt by it");
  EXPECT_EQ(complaint(kBase + "network { forward { cut_from_s: 3 cut_until_s: 2 } }"),
            "FILE:3:21: network.forward.cut_from_s = 3 must be at most cut_until_s = 2");
  EXPECT_EQ(complaint(kBase + "network { backward { cut_from_s: 3 cut_until_s: 3 } }"), "");
  EXPECT_EQ(
      complaint(kBase + "network { forward { jitter_s: 0.2 delay_s: 0.1 } }"),
      "FILE:3:21: network.forward.jitter_s = 0.2 must be at most delay_s = 0.1 with distribution UNIFORM: no packet "
      "arrives before it is sent");
  EXPECT_EQ(complaint(kBase + "network { forward { jitter_s: 0.2 distribution: NORMAL_DISTRIBUTION } }"), "");
  EXPECT_EQ(complaint(kBase + "windows { free { from_s: 3 until_s: 3 } }"),
            "FILE:3:18: windows.free.from_s = 3 must be below until_s = 3");
  EXPECT_EQ(complaint(kBase + "windows { contact { from_s: 3 until_s: 10.5 } }"),
            "FILE:3:31: windows.contact.until_s = 10.5 lies after the end of the run, duration_s = 10");
  EXPECT_EQ(
      complaint(kBase + "master { therapist { intended { duration_s: 1 ramp_to_rad: 0.1 sine_amplitude_rad: 0.1 } } }"),
      "FILE:3:22: master.therapist.intended[0] gives both ramp_to_rad and sine_amplitude_rad; one movement is a ramp, "
      "a sine or (neither) a hold");
  EXPECT_EQ(complaint(kBase + "slave { power_stage { hold_s: 0.0005 } }"),
            "FILE:3:23: slave.power_stage.hold_s = 5e-4 must be at least tick_s = 0.001: a torque is held from one "
            "command to the next");
  EXPECT_EQ(complaint(kBase + "master { host { stall_s: 0.06 } }"),
            "FILE:3:17: master.host.stall_s = 0.06 must be below every_s = 0.06");
  EXPECT_EQ(complaint(kBase + "operator_acts { at_s: 2 act: ENGAGE }\noperator_acts { at_s: 1 act: STOP }"),
            "FILE:4:17: operator_acts[1].at_s = 1 lies before the act above it, at_s = 2");
}

TEST(Load, RefusesWhatCannotBe) {
  EXPECT_EQ(complaint(kBase + "slave { motor { stop_min_rad: 0.1 } }"),
            "FILE:3:17: slave.motor.stop_min_rad = 0.1 must be at most 0: a device starts at 0 rad");
  EXPECT_EQ(complaint(kBase + "master { motor { stop_max_rad: -0.1 } }"),
            "FILE:3:18: master.motor.stop_max_rad = -0.1 must be at least 0: a device starts at 0 rad");
  EXPECT_EQ(complaint(kBase + "slave { motor { stop_min_rad: 0 } }"), "");
  EXPECT_EQ(complaint(kBase + "slave { series_elastic { stop_min_rad: 0.1 } }"), "") << "not the device of this scene";
  EXPECT_EQ(complaint(kBase + "tick_s: 0.0008\nslave { device: SERIES_ELASTIC }"),
            "FILE:3:1: tick_s = 8e-4 is shorter than a frame on the serial line of a SERIES_ELASTIC slave takes: give "
            "at least 0.00087 s");
  EXPECT_EQ(
      complaint(kBase + "tick_s: 0.006\nslave { device: SERIES_ELASTIC }"),
      "FILE:3:1: tick_s = 0.006 is too long for a SERIES_ELASTIC slave: a command and its echo may take 8 ms, and "
      "are seen a tick late; give at most 0.005 s");
  for (const char* tick : {"0.0008", "0.02"}) {
    EXPECT_EQ(complaint(kBase + "tick_s: " + tick + "\nslave { device: DIRECT_DRIVE }"), "");
  }
}

TEST(CompleteText, LoadsToTheSameScene) {
  for (const std::string& name : known_scenes()) {
    const std::string text = complete_text(load_scene(name).scene);
    EXPECT_EQ(complete_text(load_text(text)), text) << name;
  }
}

TEST(CompleteText, KeepsEveryBitOfANumber) {
  scene::Scene scene = load_text(kBase);
  std::mt19937_64 random(5);
  for (int i = 0; i < 2000; ++i) {
    const double value = std::ldexp(static_cast<double>(random()), -50);  // up to 2^14
    scene.mutable_network()->set_peer_clock_offset_s(value / 2);
    const std::string text = complete_text(scene);
    EXPECT_EQ(load_text(text).network().peer_clock_offset_s(), value / 2);
  }
  scene.mutable_control()->set_k_d_per_s(0.1);
  EXPECT_NE(complete_text(scene).find("K_d_per_s: 0.1\n"), std::string::npos);
}

// Whatever a file holds, it either loads or is refused with a sentence.
TEST(Load, SurvivesAnyMutationOfASceneFile) {
  const std::string original = read_file(load_scene("demo").path);
  const std::vector<std::string> splices = {"{", "}",    "\"",  ":",       "-",      "e999",   "0x",
                                            "#", "\n",   "nan", "[",       "]",      "<",      ">",
                                            ",", "\xc3", "1",   "control", "hand {", "ENGAGE", std::string(1, '\0')};
  std::mt19937_64 random(1);
  int loaded = 0, refused = 0;
  for (int i = 0; i < 10'000; ++i) {
    std::string text = original;
    for (auto edits = 1 + random() % 4; edits > 0 && !text.empty(); --edits) {
      const std::size_t at = random() % text.size();
      switch (random() % 4) {
        case 0:
          text[at] = static_cast<char>(random());
          break;
        case 1:
          text.erase(at, random() % 20);
          break;
        case 2:
          text.insert(at, splices[random() % splices.size()]);
          break;
        default:
          text.insert(at, text.substr(random() % text.size(), random() % 60));
      }
    }
    if (i % 100 == 0) text.resize(random() % text.size());
    const std::string sentences = complaint(text);
    ++(sentences.empty() ? loaded : refused);
  }
  EXPECT_GT(loaded, 100);
  EXPECT_GT(refused, 1000);
  std::cout << loaded << " loaded, " << refused << " refused\n";
}

TEST(Schema, GivesEveryFieldMeaningRangeAndUnit) {
  std::ostringstream json, table;
  print_schema_json(json);
  print_schema(table);
  const Json fields = Json::parse(json.str());
  EXPECT_GT(fields.size(), 100u);
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const Json field = fields[i];
    const std::string path = field["field"].text();
    EXPECT_FALSE(field["meaning"].text().empty()) << path;
    EXPECT_NE(table.str().find("\n" + path + " "), std::string::npos) << path;
    if (field["type"] == "number" || field["type"] == "integer") {
      EXPECT_TRUE(field.contains("min") && field.contains("max")) << path;
      EXPECT_TRUE(field.contains("unit") || path == "seed") << path;
    }
  }
  std::istringstream lines(table.str());
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 120u) << line;
}

}  // namespace
}  // namespace farhand
