// Two channels and wave variables on a slave behind its MCU: the torque is the MCU's to give, and to limit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/config/station_params.hpp"
#include "common/device/mcu_axis.hpp"
#include "common/judge/metrics.hpp"
#include "common/runtime/side_of.hpp"
#include "netem/lab/emulated_port.hpp"
#include "netem/lab/simulation.hpp"
#include "tests/support/session_metrics.hpp"

namespace farhand {
namespace {

using J1 = Joints<1>;

// 1/k_seen = 1/k + 1/K_2 and 1/k + 1/K_s + R/(2 b), as on a direct drive; 0.13 N m of
// the softest hand are told to 3 mN m, one count of the motor's encoder.
TEST(TorqueBehindMcu, AHandIsFeltAsItsClosedFormSays) {
  double worst = 0;
  for (const char* scene : {"two_channel", "wave"}) {
    for (const double k : {0.5, 2.0, 5.0}) {
      for (const char* grip : {"NORMAL", "FIRM"}) {
        const Metrics metrics =
            run(scene, {"slave.device=SERIES_ELASTIC", "control.K_f_per_kgm2=125",
                        std::string("master.therapist.grip=") + grip, "slave.hand.stiffness_nm_per_rad=" + number(k)});
        const double softer = scene == std::string("wave") ? 1 / 5.0 + 0.2 / (2 * 0.2) : 1 / 5.0;
        const double seen = 1 / (1 + k * softer);
        EXPECT_TRUE(metrics.is_true("stable")) << scene << k << grip;
        EXPECT_NEAR(metrics.number("force_ratio"), 1.0, 0.02) << scene << k << grip;
        EXPECT_NEAR(metrics.number("k_seen_ratio"), seen, 0.02 * seen) << scene << k << grip;
        worst = std::max(worst, std::abs(metrics.number("k_seen_ratio") / seen - 1));
      }
    }
  }
  std::printf("k_seen off by at most %.2f %%\n", 100 * worst);
}

// A patient's side behind an MCU, and a leader that says what the test wants: its torque, at the angle of the slave.
struct Follower {
  explicit Follower(std::vector<std::string> sets = {}) {
    sets.insert(sets.end(), {"slave.device=SERIES_ELASTIC", "control.K_f_per_kgm2=125",
                             "slave.hand={damping_nms_per_rad: "
                             "0.05 stiffness_nm_per_rad: 3}"});
    const LoadedScene loaded = load_scene("two_channel", sets);
    side = std::make_unique<SideOf<McuAxis<EmulatedPort>>>(slave_station_params(loaded.scene, 2), loaded.scene);
  }
  // Until the time is over, a tick per millisecond.
  void run(double until, StationState leader, const std::function<double(double)>& torque) {
    for (; now < from_seconds(until); now += kMillisecond) {
      const double t = to_seconds(now);
      Packet<1> packet;
      packet.session = 1, packet.seq = ++seq, packet.send_time_ns = now, packet.expiry_ms = 2000;
      packet.state = leader;
      packet.motion = {side->trace().local.x, J1(0), J1(-torque(t))};
      side->receive(packet, now);
      side->tick(now, t, OperatorAct::kNone, 1);
      const double tau = mcu().world().truth().spring_torque;
      largest_step = std::max(largest_step, std::abs(tau - spring));
      spring = tau;
      valid = valid && (t < 0.1 || side->device_valid());
    }
  }
  OrthosisEmulator& mcu() { return side->axis().port.orthosis().emulator(); }
  mcu::State state() { return mcu().output().state; }
  double x() { return mcu().world().true_x(); }

  std::unique_ptr<SideOf<McuAxis<EmulatedPort>>> side;
  Nanoseconds now = 0;
  std::uint32_t seq = 0;
  double spring = 0, largest_step = 0;
  bool valid = true;
};

TEST(TorqueBehindMcu, TheMcuGivesTorqueWhileEngagedTracksWhileHoldingAndNothingJumps) {
  for (const double sign : {1.0, -1.0}) {
    Follower follower;
    const auto zero = [](double) { return 0.0; };
    const auto press = [&](double t) { return sign * 0.6 * std::clamp(t - 2.0, 0.0, 1.0); };
    follower.run(0.5, StationState::kReady, zero);
    EXPECT_EQ(follower.state(), mcu::State::kSafe);
    follower.run(4.0, StationState::kEngaged, press);
    EXPECT_EQ(follower.side->trace().state, StationState::kEngaged);
    EXPECT_EQ(follower.state(), mcu::State::kTorque);
    EXPECT_NEAR(follower.x(), sign * 0.2, 2e-3);
    follower.run(6.0, StationState::kHolding, zero);
    EXPECT_EQ(follower.side->trace().state, StationState::kHolding);
    EXPECT_EQ(follower.state(), mcu::State::kTrack);
    EXPECT_NEAR(follower.x(), sign * 3.2 * 0.2 / (3.2 + 3), 3e-3);  // a spring of K_p/K_f
    follower.run(9.0, StationState::kEngaged, [&](double) { return sign * 0.45; });
    EXPECT_EQ(follower.state(), mcu::State::kTorque);
    EXPECT_NEAR(follower.x(), sign * 0.15, 2e-3);
    follower.run(9.5, StationState::kReady, zero);
    EXPECT_EQ(follower.state(), mcu::State::kSafe);
    EXPECT_TRUE(follower.valid) << "it did what it was told, as fast as it can";
    std::printf("largest change of the torque in 1 ms: %.4f N m\n", follower.largest_step);
    EXPECT_LE(follower.largest_step, 0.04);  // a motor of 4 rad/s on 10 N m/rad
  }
}

// Pressed on from 1.5 s on by a torque that rises within 0.1 s.
TEST(TorqueBehindMcu, TheScenesPowerIsTheMcus) {
  const auto fastest = [](const char* power) {
    Follower follower({std::string("slave.limits={power_w: ") + power + "}"});
    follower.run(0.5, StationState::kReady, [](double) { return 0.0; });
    follower.run(1.5, StationState::kEngaged, [](double) { return 0.0; });
    double most = 0, until = 1.5;
    while (until < 2.0) {
      follower.run(until += 1e-3, StationState::kEngaged, [](double t) { return std::min(1.0, 10 * (t - 1.5)) * 0.9; });
      const auto truth = follower.mcu().world().truth();
      most = std::max(most, truth.f * truth.v);
    }
    return most;
  };
  const double ample = fastest("20"), little = fastest("0.2");
  std::printf("0.9 N m: %.3f W where 20 are allowed, %.3f W where it is 0.2\n", ample, little);
  EXPECT_GT(ample, 0.5);
  EXPECT_LE(little, 0.2 * 1.1);
}

// What an MCU does that it was not told is a device that is lost, 0.1 s later.
TEST(TorqueBehindMcu, AnMcuThatTracksWhereTorqueIsAskedForIsLost) {
  struct Telling {
    mcu::State state = mcu::State::kSafe;
    std::uint8_t seq = 0;
    std::size_t read(std::span<std::uint8_t> bytes, double) noexcept {
      mcu::Telemetry telemetry;
      telemetry.state = state;
      telemetry.seq = seq++ & 63;
      mcu::encode(telemetry, bytes.data());
      return mcu::kWireBytes;
    }
    bool write(std::span<const std::uint8_t> bytes, double) noexcept {
      mcu::FrameDecoder decoder;
      for (const std::uint8_t byte : bytes) {
        if (decoder.push(byte)) told = mcu::unpack_command(decoder.payload());
      }
      return true;
    }
    void drop_unsent(double) noexcept {}
    bool lost() noexcept { return false; }
    mcu::Command told;
  };
  for (const bool torque : {true, false}) {
    for (const mcu::State does : {mcu::State::kTrack, mcu::State::kTorque, mcu::State::kSafe}) {
      McuAxis<Telling> axis;
      bool valid = true;
      axis.port.state = does;
      for (int ms = 0; ms < 200; ++ms) {
        const double t = 1e-3 * ms;
        valid = axis.read(t).valid;
        const bool late = ms >= 100;
        const bool obeys = does == (torque ? mcu::State::kTorque : mcu::State::kTrack);
        ASSERT_EQ(valid, obeys || !late) << ms;
        axis.write({.track = true, .gives_torque = torque, .reference = {J1(0.1), J1(0.2), J1(-0.5)}}, t);
        ASSERT_EQ(axis.port.told.mode, torque ? mcu::Mode::kTorque : mcu::Mode::kTrack);
        ASSERT_EQ(axis.port.told.f_ref, (torque ? 0.5 : -0.5) * mcu::kFRefCountsPerNm);
      }
    }
  }
}

}  // namespace
}  // namespace farhand
