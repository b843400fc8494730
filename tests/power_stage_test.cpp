// What the drive of a motor that takes a torque does by itself where commands cease, and who must say so.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>

#include "common/config/load.hpp"
#include "common/config/station_params.hpp"
#include "common/device/simulated_axis.hpp"
#include "common/runtime/side_of.hpp"

namespace farhand {
namespace {

constexpr double kJ = 4e-3, kTorque = 0.01;
constexpr TorqueHold kStage{.hold_s = 2e-3, .fall_s = 4e-3};

// A motor with nothing but inertia, far from its stops, under one command.
SimulatedAxis<DirectSlaveWorld> commanded_once() {
  DirectSlaveWorld::Params world;
  world.motor.J = kJ;
  world.motor.viscous = 0;
  SimulatedAxis<DirectSlaveWorld> axis(world);
  axis.power_stage(kStage);
  axis.read(0);
  axis.write({.torque = Joints<1>(kTorque)}, 0);
  return axis;
}

TEST(PowerStage, HoldsATorqueAndThenLetsItFallToZero) {
  for (const double t_s : {1e-3, 2e-3, 6e-3, 7e-3, 1.0}) {
    auto axis = commanded_once();
    axis.read(t_s);
    // The impulse of a torque that is whole for 2 ms and falls straight over 4 ms.
    const double whole_s = std::min(t_s, 2e-3) + (t_s > 5.9e-3 ? 0.5 * 4e-3 : 0.0);
    EXPECT_NEAR(axis.truth().v, kTorque / kJ * whole_s, 1e-12) << t_s;
  }
}

TEST(PowerStage, DoesTheSameHoweverOftenItIsLookedAt) {
  auto once = commanded_once(), often = commanded_once();
  for (int k = 1; k <= 100; ++k) often.go_on(1e-4 * k);
  once.read(0.01);
  EXPECT_NEAR(often.truth().v, once.truth().v, 1e-12);
  EXPECT_NEAR(often.truth().x, once.truth().x, 1e-12);
}

TEST(PowerStage, ShareIsWholeThenFallsThenIsNothing) {
  EXPECT_EQ(kStage.share(0), 1);
  EXPECT_EQ(kStage.share(2e-3), 1);
  EXPECT_NEAR(kStage.share(4e-3), 0.5, 1e-12);
  EXPECT_EQ(kStage.share(6e-3), 0);
  EXPECT_EQ(kStage.share(1e9), 0);
  const TorqueHold at_once{.hold_s = 2e-3, .fall_s = 0};
  EXPECT_EQ(at_once.share(2e-3), 1);
  EXPECT_EQ(at_once.share(2.1e-3), 0);
}

// As a driver of a motor on the table would be.
struct TableAxis {
  using Io = DirectIo<1>;
  static constexpr bool kSimulated = false;
  TorqueHold contract;
  void power_stage(const TorqueHold& of_scene) { contract = of_scene; }
  Io::Sensed read(double) noexcept { return {}; }
  void write(const Io::Command&, double) noexcept {}
  Truth truth() const noexcept { return kNoTruth; }
};

const std::string kBase = "architecture: FOUR_CHANNEL duration_s: 1\n";

std::string refusal(const std::string& more, bool master) {
  const scene::Scene scene = load_scene_text(kBase + more, "text").scene;
  try {
    SideOf<TableAxis> side(master ? master_station_params(scene, 1) : slave_station_params(scene, 1));
    return "";
  } catch (const std::invalid_argument& refused) {
    return refused.what();
  }
}

TEST(PowerStage, OfAMotorThatIsNotSimulatedMustBeNamedByItsScene) {
  for (const char* side : {"master", "slave"}) {
    const std::string name = side;
    const std::string said = name + ".power_stage: the drive of a motor that is not simulated needs " + name +
                             ".power_stage.hold_s and " + name +
                             ".power_stage.fall_s in the scene: for how many s it holds a torque after the last "
                             "command, and within how many s it then lets it fall to zero by itself";
    const auto with = [&](const std::string& stage) {
      return refusal(name + " { power_stage {" + stage + "} }", name == "master");
    };
    EXPECT_EQ(with(""), said);
    EXPECT_EQ(with("hold_s: 0.003"), said);
    EXPECT_EQ(with("fall_s: 0.003"), said);
    EXPECT_EQ(with("hold_s: 0.003 fall_s: 0"), "");
  }
}

TEST(PowerStage, IsToldToTheDeviceAndBySimulatedOnesTakenFromTheTick) {
  const scene::Scene named =
      load_scene_text(kBase + "slave { power_stage { hold_s: 0.005 fall_s: 0.007 } }", "text").scene;
  SideOf<TableAxis> side(slave_station_params(named, 1));
  EXPECT_EQ(side.axis().contract.hold_s, 0.005);
  EXPECT_EQ(side.axis().contract.fall_s, 0.007);
  const StationParams usual = master_station_params(load_scene_text(kBase + "tick_s: 0.002", "text").scene, 1);
  EXPECT_EQ(usual.control.drive.power_stage.hold_s, 2 * 0.002);
  EXPECT_EQ(usual.control.drive.power_stage.fall_s, 4 * 0.002);
}

}  // namespace
}  // namespace farhand
