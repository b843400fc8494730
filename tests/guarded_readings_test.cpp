// What the patient's station makes of readings that its guard, or the device itself, finds wrong, and of a hand that
// shakes by itself.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>

#include "common/runtime/owned_station.hpp"

namespace farhand {
namespace {

using S = StationState;

// The patient's side on a device that says what the test wants, with a therapist's side that engages when told.
class Box {
 public:
  explicit Box(bool homing = false) {
    StationParams params;
    params.role = Role::kFollower;
    params.engagement.homing = homing;
    params.receive = {.timeout = 100 * kMillisecond, .playout_max = 2 * kSecond, .expiry = 2 * kSecond};
    station_ = std::make_unique<OwnedStation<ReferenceIo<1>>>(params);
  }

  void tick(OperatorAct act = OperatorAct::kNone) {
    now_ += kMillisecond;
    Packet<1> packet{.session = 7, .motion = {}};
    packet.seq = ++seq_;
    packet.send_time_ns = now_;
    packet.state = leader;
    packet.motion.x[0] = sensed.x[0];
    station_->receive(packet, now_);
    station_->tick(now_, sensed, act);
  }
  void run(int ticks) {
    for (int k = 0; k < ticks; ++k) tick();
  }
  S state() const { return station_->trace().state; }
  Reason reason() const { return station_->trace().reason; }

  ReferenceIo<1>::Sensed sensed{.x = Joints<1>(0.1), .f = Joints<1>(0.0), .valid = true};
  S leader = S::kReady;

 private:
  std::unique_ptr<OwnedStation<ReferenceIo<1>>> station_;
  Nanoseconds now_ = 0;
  std::uint32_t seq_ = 0;
};

// Its cable was out, and the hand went elsewhere.
TEST(GuardedReadings, ADeviceThatComesBackElsewhereIsNoJump) {
  Box box;
  for (int k = 0; k < 2900; ++k) {
    box.sensed.valid = k % 1000 < 900;
    box.sensed.x[0] = k < 950 ? 0.1 : k < 1950 ? -0.3 : 0.2;
    box.tick();
    ASSERT_NE(box.state(), S::kFault) << k;
  }
  box.sensed.valid = true;
  box.run(100);
  ASSERT_EQ(box.state(), S::kReady);
  box.sensed.x[0] = 0.1;
  box.tick();
  EXPECT_EQ(box.state(), S::kFault);
  EXPECT_EQ(box.reason(), Reason::kEncoderJump);
}

// A line that is late repeats a reading; the next one may be as far away as in all that time.
TEST(GuardedReadings, AReadingThatIsRepeatedIsNoJumpAfterwards) {
  Box box;
  box.run(100);
  box.sensed.periods = 0;
  box.run(20);
  box.sensed.periods = 1;
  box.sensed.x[0] += 0.02;  // 1 rad/s
  box.tick();
  EXPECT_EQ(box.state(), S::kReady);
}

TEST(GuardedReadings, AnAngleThatIsNotKnownYetCannotJump) {
  Box box(true);
  box.run(100);
  box.sensed.x[0] = 40;
  box.run(100);
  EXPECT_EQ(box.state(), S::kSelfTest);
}

TEST(GuardedReadings, WhatTheDeviceFindsWrongLatchesAndOutlivesEveryResetBeforeItIsOver) {
  for (const auto& [fault, reason] : {std::pair(DeviceFault::kSpring, Reason::kSpringDisagrees),
                                      std::pair(DeviceFault::kEncoder, Reason::kEncoderJump)}) {
    Box box;
    box.run(100);
    // First it is in a fault, then it says in which.
    box.sensed.valid = false;
    box.run(10);
    EXPECT_EQ(box.state(), S::kOff);
    box.sensed.device.fault = fault;
    box.tick();
    EXPECT_EQ(box.state(), S::kFault);
    EXPECT_EQ(box.reason(), reason);
    box.tick(OperatorAct::kReset);
    box.tick();
    EXPECT_EQ(box.state(), S::kFault);
    box.sensed.device.fault = DeviceFault::kNone;
    box.sensed.valid = true;
    box.run(100);
    EXPECT_EQ(box.state(), S::kFault);
    box.tick(OperatorAct::kReset);
    box.run(50);
    EXPECT_EQ(box.state(), S::kReady);
  }
}

// 4 rad/s at 6 Hz. The edge has come when it calms down: nothing begins by itself later than the play-out and the
// blend.
TEST(GuardedReadings, NobodyTakesAHandThatShakes) {
  Box box;
  box.run(100);
  box.leader = S::kAligning;
  const auto shake = [&](int ticks) {
    for (int k = 0; k < ticks; ++k) {
      box.sensed.x[0] = 0.1 * std::cos(12 * std::numbers::pi * 1e-3 * k);  // from where it is, at rest
      box.tick();
      ASSERT_EQ(box.state(), S::kReady) << k;
    }
  };
  shake(2000);
  box.leader = S::kEngaged;
  shake(2000);
  box.run(4000);
  EXPECT_EQ(box.state(), S::kEngaged);
}

}  // namespace
}  // namespace farhand
