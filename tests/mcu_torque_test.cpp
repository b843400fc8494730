// TORQUE on the MCU: what bounds the torque that a host asks for, and the change between it and TRACK. The joint goes
// where the test moves it, as in a hand that is stronger than the device, or where the torque does.
#include <gtest/gtest.h>

#include "slave/mcu/emulator.hpp"
#include "tests/support/mcu_bench.hpp"
#include "tests/support/mcu_reference.hpp"

namespace farhand::mcu {
namespace {

TEST(McuTorque, FollowsTheLawInDoublePrecisionToItsQuantisation) {
  const McuSettings s = with_ample_power();
  Bench bench(s);
  McuReference reference(s);
  double v_ref = 0, f_ref = 0, worst = 0;
  int bounded = 0;
  for (int k = 0; k < 40'000; ++k) {
    const double t = k / s.loop_hz;
    const double x = 0.33 * std::sin(0.7 * M_PI * t) + 0.002 * std::sin(2 * M_PI * 19 * t);
    const double x_motor = x + 0.1 * std::sin(2 * M_PI * 1.3 * t);
    if (k % 2 == 0) {
      const Command command = make_command(k < 10 ? Mode::kSafe : Mode::kTorque, bench.seq++, x,
                                           0.7 * std::cos(2.2 * t), 1.4 * std::sin(2 * M_PI * 0.9 * t));
      bench.send(command);
      const auto gate = [](double now, double goal, double step) { return std::clamp(goal, now - step, now + step); };
      v_ref = gate(v_ref, command.v_ref / 1024.0, s.acceleration_limit * 1e-3);
      f_ref = gate(f_ref, command.f_ref / 2048.0, s.force_rate_limit * 1e-3);
    }
    bench.loop(x, x_motor);
    const double unit = encoder_unit_rad(s.joint_counts_per_rev);
    reference.estimate(counts_of(x) * unit, counts_of(x_motor) * unit);
    reference.give_torque(v_ref, f_ref, s.torque_limit);
    if (k < 300) continue;  // the start ramp, and the gates from where the joint was
    worst = std::max(worst, std::abs(to_nm(bench.core.torque_command()) - reference.tau_command));
    bounded += reference.bounded;
  }
  std::printf("worst %.2g N m, bounded in %d of 40000 loops\n", worst, bounded);
  EXPECT_LT(worst, 2e-5);  // five times less than a count of the telemetry shows
  EXPECT_GT(bounded, 1000);
  EXPECT_LT(bounded, 39'000);
}

// The orthosis without a hand, pushed as hard as a frame can say.
TEST(McuTorque, AFreeJointKeepsToItsTopSpeedAndItsRange) {
  for (const double sign : {1.0, -1.0}) {
    OrthosisEmulator::Params params;
    params.mcu = with_ample_power(params.mcu);
    params.mcu.velocity_limit = 1.5;
    OrthosisEmulator orthosis(params);
    std::uint8_t wire[kWireBytes], seq = 0;
    double fastest = 0, farthest = 0, late_low = 1, late_high = -1;
    for (int k = 0; k < 6000; ++k) {
      if (k % 2 == 0) {
        const bool pull_back = k < 1000;  // first to the other end
        const double f = k < 10 ? 0 : (pull_back ? -3.9 : 3.9) * sign;
        encode(make_command(k < 6 ? Mode::kSafe : Mode::kTorque, seq++, 0, k < 6 ? 0 : 8 * f / 3.9, f), wire);
        for (const std::uint8_t byte : wire) orthosis.receive(byte);
      }
      orthosis.tick(wire);
      const double x = sign * orthosis.world().true_x();
      fastest = std::max(fastest, std::abs(to_rad_s(orthosis.core().velocity())));
      farthest = std::max(farthest, std::abs(x));
      if (k > 4000) late_low = std::min(late_low, x), late_high = std::max(late_high, x);
    }
    std::printf("fastest %.3f of 1.5 rad/s, farthest %.4f of 0.349 rad, at the end %.2f mrad peak to peak\n", fastest,
                farthest, (late_high - late_low) * 1e3);
    EXPECT_EQ(orthosis.output().state, State::kTorque);
    EXPECT_GT(fastest, 1.2);
    EXPECT_LE(fastest, 1.5 * 1.1);
    EXPECT_LE(farthest, 0.349 + 3e-3);
    EXPECT_NEAR(late_high, 0.349, 3e-3);
    EXPECT_LE(late_high - late_low, 2e-3);  // six counts; what shakes has 5 mrad
  }
}

// A hand that pulls to 0.5 rad, and a host that pushes it on: it is held at the end of the range, as in TRACK.
TEST(McuTorque, AHandThatPullsOutOfTheRangeIsHeldAtItsEnd) {
  for (const double sign : {1.0, -1.0}) {
    OrthosisEmulator::Params params;
    params.world.environment.hand = Hand::Params{2, 0.05, sign * 0.5, 0, 1e9};
    OrthosisEmulator orthosis(params);
    std::uint8_t wire[kWireBytes], seq = 0;
    for (int k = 0; k < 6000; ++k) {
      if (k % 2 == 0) {
        encode(make_command(k < 6 ? Mode::kSafe : Mode::kTorque, seq++, 0, 0, k < 6 ? 0 : sign * 2), wire);
        for (const std::uint8_t byte : wire) orthosis.receive(byte);
      }
      orthosis.tick(wire);
    }
    EXPECT_NEAR(sign * orthosis.world().true_x(), params.mcu.range_max, 2e-3);
  }
}

// Pressed on the hand by one mode, then by the other, and back: three frames each.
TEST(McuTorque, ChangesToTrackAndBackWithoutAStepOfTheTorque) {
  OrthosisEmulator::Params params;
  params.world.environment.hand = Hand::Params{3, 0.05, 0, 0, 1e9};
  params.mcu.joint_counts_per_rev = params.mcu.motor_counts_per_rev = 0;  // else a count that falls is 0.05 N m
  params.world.actuator.joint_counts_per_rev = params.world.actuator.motor_counts_per_rev = 0;
  OrthosisEmulator orthosis(params);
  std::uint8_t wire[kWireBytes], seq = 0;
  const auto frames = [&](int count, Mode mode, double x, double f, const auto& each) {
    for (int n = 0; n < count; ++n) {
      encode(make_command(mode, seq++, x, 0, f), wire);
      for (const std::uint8_t byte : wire) orthosis.receive(byte);
      for (int half = 0; half < 2; ++half) orthosis.tick(wire), each();
    }
  };
  const auto nothing = [] {};
  frames(3, Mode::kSafe, 0, 0, nothing);
  for (int n = 0; n < 300; ++n) frames(1, Mode::kTorque, 0, 0.6 * n / 300, nothing);
  frames(1000, Mode::kTorque, 0, 0.6, nothing);
  const double x = orthosis.world().true_x(), torque = to_nm(orthosis.core().torque_command());
  EXPECT_NEAR(x, 0.2, 3e-3);
  double before = torque, step = 0, moved = 0;
  const auto watch = [&] {
    step = std::max(step, std::abs(to_nm(orthosis.core().torque_command()) - before));
    before = to_nm(orthosis.core().torque_command());
    moved = std::max(moved, std::abs(orthosis.world().true_x() - x));
  };
  frames(2, Mode::kTrack, x, -0.6, watch);
  EXPECT_EQ(orthosis.output().state, State::kTorque);
  frames(1000, Mode::kTrack, x, -0.6, watch);
  EXPECT_EQ(orthosis.output().state, State::kTrack);
  frames(1000, Mode::kTorque, 0, 0.6, watch);
  EXPECT_EQ(orthosis.output().state, State::kTorque);
  std::printf("changes of mode: steps up to %.4f N m, the hand moves by %.2f mrad\n", step, moved * 1e3);
  EXPECT_LE(step, 0.03);
  EXPECT_LE(moved, 3e-3);
  // A host that asks for something else at once gets it over the ramp, or by the steps of a frame.
  frames(3, Mode::kTrack, 0, 0, watch);
  EXPECT_LE(step, 0.35);
}

TEST(McuTorque, OnlyThreeConsistentFramesInARowChangeTheMode) {
  for (const auto& [from, to] : {std::pair(Mode::kTrack, Mode::kTorque), {Mode::kTorque, Mode::kTrack}}) {
    const auto state_after = [from = from](auto frames) {
      Bench bench;
      bench.activate(from);
      frames(bench);
      return bench.loop().state;
    };
    const auto send = [](Bench& b, Mode mode, int count) {
      for (int i = 0; i < count; ++i) b.send(mode), b.frame_time();
    };
    const State before = from == Mode::kTrack ? State::kTrack : State::kTorque;
    const State after = to == Mode::kTrack ? State::kTrack : State::kTorque;
    const Mode other = to, own = from;
    EXPECT_EQ(state_after([&](Bench& b) { send(b, other, 2); }), before);
    EXPECT_EQ(state_after([&](Bench& b) { send(b, other, 3); }), after);
    EXPECT_EQ(state_after([&](Bench& b) { send(b, other, 3), send(b, own, 2); }), after);
    EXPECT_EQ(state_after([&](Bench& b) { send(b, other, 3), send(b, own, 3); }), before);
    EXPECT_EQ(state_after([&](Bench& b) { send(b, other, 2), send(b, own, 1), send(b, other, 2); }), before);
    EXPECT_EQ(state_after([&](Bench& b) { send(b, other, 2), ++b.seq, send(b, other, 2); }), before);
    EXPECT_EQ(state_after([&](Bench& b) { send(b, other, 2), --b.seq, send(b, other, 2); }), before);
    EXPECT_EQ(
        state_after([&](Bench& b) { send(b, other, 2), b.send(other, 0, 0, 1.0), b.frame_time(), send(b, other, 1); }),
        before);
    // Out of a ramp leads no frame but what leads out of SAFE.
    EXPECT_EQ(state_after([&](Bench& b) { b.send(Mode::kSafe), b.loop(), send(b, other, 200); }), State::kSafe);
  }
}

}  // namespace
}  // namespace farhand::mcu
