// An axis identified from a recording.
#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <sstream>
#include <string>

#include "common/identify/sweeps.hpp"
#include "common/plant/world.hpp"
#include "common/record/recording.hpp"
#include "netem/lab/identify.hpp"
#include "tests/support/identified_session.hpp"
#include "tests/support/scratch_directory.hpp"

namespace farhand {
namespace {

struct Recordings {
  ScratchDirectory directory;
  std::string file(const char* name) const { return (directory / name).string(); }
  std::string write(const char* name, const std::vector<std::string>& sets) const {
    write_session_mcap(session_of(sets), file(name));
    return file(name);
  }
};

std::string refusal(const std::string& file, const std::string& side, const KnownInertia& known = {}) {
  try {
    identify_recording(file, side, known);
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

TEST(IdentifyRecording, ARecordingTellsTheSameOffline) {
  const Recordings to;
  const std::string file = to.write("free.mcap", freed({}));
  const Identified found = identify_recording(file, "");
  EXPECT_EQ(found.side, IdentifiedSide::kSlave) << "the one that was led";
  EXPECT_TRUE(accepted(found));
  EXPECT_NEAR(found.axis.J.value, 4e-3, 0.01 * 4e-3);
  EXPECT_NEAR(found.axis.coulomb.value, 0.02, 0.01 * 0.02);
  EXPECT_NEAR(found.axis.viscous.value, 2e-3, 0.03 * 2e-3);
  std::ostringstream text;
  print_identified(found, text);
  const std::size_t line = text.str().find("slave { axis { J_n_kgm2: 0.00");
  ASSERT_NE(line, std::string::npos) << text.str();
  const std::string set = text.str().substr(line);
  EXPECT_NE(set.find(" coulomb_nm: 0.0"), std::string::npos) << set;
  EXPECT_EQ(text.str().find("refused"), std::string::npos);

  const std::string heavier = to.write("heavier.mcap", freed({"slave.motor.J_kgm2=0.006"}));
  const Identified scaled = identify_recording(file, "slave", {.own_kgm2 = {}, .loaded = heavier, .added_kgm2 = 2e-3});
  ASSERT_TRUE(scaled.torque_scale);
  EXPECT_NEAR(scaled.torque_scale->value, 1.0, 0.01);
  const Identified known = identify_recording(file, "slave", {.own_kgm2 = 2e-3, .loaded = "", .added_kgm2 = 0});
  EXPECT_NEAR(known.torque_scale->value, 0.5, 0.005) << "half of the inertia: half of the torque constant";
  std::ostringstream halved;
  print_identified(known, halved);
  EXPECT_NE(halved.str().find("J_n_kgm2: 0.002 "), std::string::npos) << halved.str();
  EXPECT_NE(halved.str().find("K_tn_nm_per_a: 0.07"), std::string::npos) << halved.str();
  EXPECT_NE(refusal(heavier, "slave", {.own_kgm2 = {}, .loaded = file, .added_kgm2 = 2e-3}).find("no more inertia"),
            std::string::npos);
}

TEST(IdentifyRecording, ARecordingOfAnotherAxisOrOfNoneIsRefused) {
  const Recordings to;
  const std::string held = to.write("held.mcap", freed({"slave.hand={stiffness_nm_per_rad: 2}"}));
  EXPECT_EQ(identify_recording(held, "slave").axis_misfit, Misfit::kHeld);
  const Identified still = identify_recording(held, "master");
  EXPECT_EQ(still.axis_misfit, Misfit::kTooLittleMotion) << "the master stood";
  EXPECT_FALSE(accepted(still));
  EXPECT_NE(refusal(held, "mcu").find("holds no samples of mcu"), std::string::npos);
  EXPECT_NE(refusal(held, "patient").find("none of master, slave, mcu"), std::string::npos);
  EXPECT_NE(refusal(to.file("missing.mcap"), "").find("cannot read"), std::string::npos);
  std::ofstream(to.file("text.mcap")) << "no recording";
  EXPECT_NE(refusal(to.file("text.mcap"), ""), "");
}

// The MCU's recording: the joint is led by the spring, then loaded against its stop.
TEST(IdentifyRecording, TheOrthosisIsIdentifiedFromTheRecordingOfItsMcu) {
  const Recordings to;
  const LoadedScene loaded = load_scene("demo");
  record::RunInfo info;
  info.set_scene_name("demo");
  info.set_scene_text(complete_text(loaded.scene));
  info.set_role("mcu");
  Recording recording(to.file("mcu.mcap"), info);
  SeriesElasticWorld::Params params;
  params.actuator.viscous = 4e-3;
  SeriesElasticWorld world(params);
  Sweeps sweeps({}, 1e-3);
  sweeps.begin(0);
  for (int k = 0; k < 90'000; ++k) {
    const double t = 1e-3 * (k + 1);
    const SeriesElasticWorld::Truth truth = world.truth();
    McuSample sample;
    sample.true_x_rad = world.encoder();
    sample.motor_x_rad = world.motor_encoder();
    sample.spring_torque_nm = truth.spring_torque;
    recording.write(from_seconds(t), sample);
    const Motion<1> target = sweeps.step(1);
    const double wish = sweeps.done() ? 0.45 + 0.12 * std::sin(0.8 * t) : target.x[0];
    world.advance((sweeps.done() ? 0.0 : target.v[0]) + 10 * (wish - truth.motor_x), t);
  }
  recording.finish({});
  const Identified found = identify_recording(to.file("mcu.mcap"), "");
  ASSERT_TRUE(found.spring);
  EXPECT_NEAR(found.spring->k.value, 10, 0.02 * 10);
  EXPECT_EQ(found.spring_misfit, Misfit::kNone);
  EXPECT_NEAR(found.axis.J.value, 4e-3, 0.03 * 4e-3);
  std::ostringstream text;
  print_identified(found, text);
  EXPECT_NE(text.str().find("slave { series_elastic { spring_nm_per_rad: "), std::string::npos) << text.str();
  std::printf("%s", text.str().c_str());
}

}  // namespace
}  // namespace farhand
