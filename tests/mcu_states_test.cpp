// The states of the MCU core against what a patient's safety needs: what starts it, what ends it, what feeds its
// watchdog.
#include <gtest/gtest.h>

#include <random>

#include "tests/support/mcu_bench.hpp"
#include "tests/support/mcu_reference.hpp"

namespace farhand::mcu {
namespace {

TEST(McuCore, NothingMovesInSafeAtStartWhateverTheReferences) {
  Bench bench;
  for (int i = 0; i < 2000; ++i) {
    bench.send(i % 2 ? Mode::kTrack : Mode::kTorque, 0.3, 1, 2);
    const McuOutput output = bench.frame_time();
    ASSERT_EQ(output.motor_velocity, 0);
    ASSERT_EQ(output.state, State::kSafe);
  }
}

TEST(McuCore, SafeDrivesTheSpringTorqueToZeroInBothDirections) {
  for (const double sign : {1.0, -1.0}) {
    Bench bench;
    for (int i = 0; i < 100; ++i) bench.loop(0.1, 0.1 + sign * 0.02);
    const double u = to_rad_s(bench.loop(0.1, 0.1 + sign * 0.02).motor_velocity);
    EXPECT_NEAR(u, -sign * 10 * 10 * 0.02, 10 * 10 * 1.6e-4 * 2);
  }
}

TEST(McuCore, OnlyASafeFrameAndThreeConsistentFramesStart) {
  const auto state_after = [](auto frames) {
    Bench bench;
    frames(bench);
    return bench.loop().state;
  };
  const auto track = [](Bench& bench, int count) {
    for (int i = 0; i < count; ++i) bench.send(Mode::kTrack), bench.frame_time();
  };
  EXPECT_EQ(state_after([&](Bench& b) { track(b, 100); }), State::kSafe);
  EXPECT_EQ(state_after([&](Bench& b) { b.send(Mode::kSafe), track(b, 2); }), State::kSafe);
  EXPECT_EQ(state_after([&](Bench& b) { b.send(Mode::kSafe), track(b, 3); }), State::kTrack);
  EXPECT_EQ(state_after([&](Bench& b) {
              b.send(Mode::kSafe);
              for (int i = 0; i < 3; ++i) b.send(Mode::kTorque), b.frame_time();
            }),
            State::kTorque);
  // One frame lost, one of the other mode, one SAFE, a repeated number, a jump of the reference: counting starts again.
  EXPECT_EQ(state_after([&](Bench& b) { b.send(Mode::kSafe), track(b, 2), ++b.seq, track(b, 2); }), State::kSafe);
  EXPECT_EQ(state_after([&](Bench& b) { b.send(Mode::kSafe), track(b, 2), b.send(Mode::kTorque), track(b, 2); }),
            State::kSafe);
  EXPECT_EQ(state_after([&](Bench& b) { b.send(Mode::kSafe), track(b, 2), b.send(Mode::kSafe), track(b, 2); }),
            State::kSafe);
  EXPECT_EQ(state_after([&](Bench& b) { b.send(Mode::kSafe), track(b, 2), --b.seq, track(b, 2); }), State::kSafe);
  for (int field = 0; field < 3; ++field) {
    EXPECT_EQ(state_after([&](Bench& b) {
                b.send(Mode::kSafe), track(b, 2);
                b.send(Mode::kTrack, field == 0 ? 0.1 : 0, field == 1 ? 1.0 : 0, field == 2 ? 1.0 : 0), track(b, 2);
              }),
              State::kSafe);
  }
  EXPECT_EQ(state_after([&](Bench& b) { b.send(Mode::kSafe), track(b, 2), ++b.seq, track(b, 3); }), State::kTrack);
  // The SAFE frame is forgotten with the link.
  EXPECT_EQ(state_after([&](Bench& b) {
              b.send(Mode::kSafe);
              for (int i = 0; i < 41; ++i) b.loop();
              track(b, 50);
            }),
            State::kSafe);
  // Parameter frames are no sign of life and no edge.
  EXPECT_EQ(state_after([&](Bench& b) { b.send(Mode::kConfig), track(b, 50); }), State::kSafe);
}

TEST(McuCore, SilenceLetsGoFrom20MsAndIsSafe50MsLater) {
  McuSettings settings = with_ample_power();
  settings.joint_counts_per_rev = settings.motor_counts_per_rev = 0;
  Bench bench(settings);
  bench.activate(Mode::kTorque);
  for (int i = 0; i < 400; ++i) bench.send(Mode::kTorque, 0, 0, 1.0), bench.held_frame_time();
  bench.send(Mode::kTorque, 0, 0, 1.0);
  const double pressed = to_nm(bench.core.torque_command());
  ASSERT_NEAR(pressed, 1.0, 1e-3);
  for (int k = 0; k < 200; ++k) {  // loop k is k/2 ms after the last frame
    const McuOutput output = bench.held_loop();
    const double tau = to_nm(bench.core.torque_command());
    const double expected = pressed * (k < 40 ? 1.0 : std::max(0.0, 1.0 - (k - 39) / 4.0));
    ASSERT_NEAR(tau, expected, 1e-4) << k;
    ASSERT_EQ(output.state, k < 139 ? State::kTorque : State::kSafe) << k;
    ASSERT_EQ(bench.core.faults(), k < 139 ? 0 : kWatchdog);
  }
  EXPECT_EQ(bench.core.torque_command(), 0);
}

// A host that was away for some ms: until SAFE it takes the hand again, from the torque that the spring has by then, in
// either mode, and what it wanted before is there again after the ramp time.
TEST(McuCore, AHostThatComesBackBeforeSafeTakesTheHandAgainWithoutAJump) {
  McuSettings settings = with_ample_power();
  settings.joint_counts_per_rev = settings.motor_counts_per_rev = 0;
  for (const Mode mode : {Mode::kTorque, Mode::kTrack}) {
    for (const double sign : {1.0, -1.0}) {
      for (int silent = 36; silent < 137; ++silent) {  // loops, besides the two of the last frame
        Bench bench(settings);
        bench.winds_at = settings.motor_speed_limit;
        const auto frame = [&] {
          if (mode == Mode::kTorque) {
            bench.send(mode, 0, 0, sign);
          } else {
            bench.send(mode, sign * 0.3, 0, 0);
          }
        };
        bench.activate(mode);
        for (int i = 0; i < 400; ++i) frame(), bench.held_frame_time();
        const double pressed = to_nm(bench.core.torque_command());
        ASSERT_GT(pressed * sign, 0.3);
        for (int k = 0; k < silent; ++k) bench.held_loop();
        double before = to_nm(bench.core.driven() ? bench.core.torque_command() : bench.core.spring_torque());
        for (int i = 0; i < 400; ++i) {
          frame();
          for (int k = 0; k < 2; ++k) {
            ASSERT_NE(bench.held_loop().state, State::kSafe);
            const double torque = to_nm(bench.core.torque_command());
            // It grows by 3 N m in 50 ms; what falls falls by a step of f_ref besides.
            ASSERT_LE(std::abs(torque) - std::abs(before), 0.03 + 1e-3) << silent << " " << i;
            ASSERT_LE(std::abs(torque - before), 0.03 + settings.J_n * settings.K_f * 0.3 + 1e-3) << silent;
            before = torque;
          }
        }
        EXPECT_NEAR(to_nm(bench.core.torque_command()), pressed, 0.05 * std::abs(pressed));
        EXPECT_EQ(bench.core.faults(), 0);
      }
    }
  }
}

// What says nothing about a host that still thinks.
TEST(McuCore, NothingButANewFrameOfItsModeFeedsTheWatchdog) {
  const std::pair<const char*, void (*)(Bench&)> feeds[] = {
      {"nothing", [](Bench&) {}},
      {"the last frame again", [](Bench& b) { --b.seq, b.send(Mode::kTrack); }},
      {"frames of the other mode, never three in a row", [](Bench& b) { b.seq += 2, b.send(Mode::kTorque); }},
      {"parameter frames", [](Bench& b) { b.send(Mode::kConfig); }},
      {"zeros", [](Bench& b) { b.core.receive(0); }},
      {"a bit flipped in each",
       [](Bench& b) {
         std::uint8_t wire[kWireBytes];
         encode(make_command(Mode::kTrack, b.seq++, 0, 0, 0), wire);
         wire[3] ^= 1;
         for (const std::uint8_t byte : wire) b.core.receive(byte);
       }},
      {"cut short",
       [](Bench& b) {
         std::uint8_t wire[kWireBytes];
         encode(make_command(Mode::kTrack, b.seq++, 0, 0, 0), wire);
         for (int i = 2; i < kWireBytes; ++i) b.core.receive(wire[i]);
       }},
  };
  for (const auto& [name, feed] : feeds) {
    Bench bench;
    bench.activate(Mode::kTrack);
    bench.send(Mode::kTrack);
    for (int k = 0; k < 160; ++k) {
      if (k % 2 == 1) feed(bench);
      const State state = bench.loop().state;
      ASSERT_EQ(bench.core.driven(), k < 40) << name << " " << k;
      ASSERT_EQ(bench.core.faults(), k < 139 ? 0 : kWatchdog) << name << " " << k;
      ASSERT_EQ(state, k < 139 ? State::kTrack : State::kSafe) << name << " " << k;
    }
  }
}

TEST(McuCore, AfterTheWatchdogOnlyTheExplicitEdgeStartsAgain) {
  Bench bench;
  bench.activate(Mode::kTrack);
  for (int k = 0; k < 140; ++k) bench.loop();
  for (int i = 0; i < 500; ++i) {  // the peer resumes as if nothing had been
    bench.send(Mode::kTrack);
    ASSERT_EQ(bench.frame_time().state, State::kSafe);
  }
  EXPECT_EQ(bench.core.faults(), kWatchdog);
  bench.send(Mode::kSafe), bench.frame_time();
  for (int i = 0; i < 3; ++i) bench.send(Mode::kTrack), bench.frame_time();
  EXPECT_EQ(bench.loop().state, State::kTrack);
  EXPECT_EQ(bench.core.faults(), 0);
}

// From activity, from silence and from another stop, by a SAFE frame as by a stop: within 2 ms, and nothing is latched.
TEST(McuCore, ASafeFrameLetsGoWithinTwoMilliseconds) {
  for (const bool stop : {false, true}) {
    for (const int silent : {0, 44, 100, 134}) {  // loops
      Bench bench;
      bench.activate(Mode::kTorque);
      for (int i = 0; i < 200; ++i) bench.send(Mode::kTorque, 0, 0, -3.0), bench.held_frame_time();
      const std::int32_t pressed = bench.core.torque_command();
      ASSERT_LT(pressed, 0);
      for (int i = 0; i < silent; ++i) bench.held_loop();
      for (int k = 1; k <= 4; ++k) {
        bench.send(stop ? make_stop(bench.seq++) : make_command(Mode::kSafe, bench.seq++, 0, 0, 0));
        bench.held_loop();
        const double expected = silent == 0 ? to_nm(pressed) * (1 - k / 4.0) : 0;
        ASSERT_NEAR(to_nm(bench.core.torque_command()), expected, 1e-4) << silent;
      }
      EXPECT_EQ(bench.core.torque_command(), 0);
      EXPECT_EQ(bench.held_loop().state, State::kSafe);
      EXPECT_EQ(bench.core.faults(), 0);
      bench.send(Mode::kSafe);
      for (int i = 0; i < 200; ++i) {
        bench.send(Mode::kTrack);
        ASSERT_EQ(bench.held_frame_time().state, i < 2 ? State::kSafe : State::kTrack) << i;
      }
    }
  }
}

// Every forged frame is valid to the CRC. The worst that one can do is a step of each reference, or a stop.
TEST(McuCore, OneForgedFrameMovesTheReferencesByAtMostOneStep) {
  std::mt19937 random(9);
  const McuSettings s;
  Bench steady(s);
  steady.activate(Mode::kTrack);
  for (int n = 0; n < 10'000; ++n) {
    Bench bench = steady;
    std::uint8_t payload[kPayloadBytes], wire[kWireBytes];
    for (auto& byte : payload) byte = static_cast<std::uint8_t>(random());
    encode_frame(payload, wire);
    for (const std::uint8_t byte : wire) bench.core.receive(byte);
    const double x_step = s.velocity_limit * 1e-3, v_step = s.acceleration_limit * 1e-3,
                 f_step = s.force_rate_limit * 1e-3;
    for (int k = 0; k < 39; ++k) {  // however long it stays the newest
      const McuOutput output = bench.loop();
      ASSERT_LE(std::abs(to_rad(bench.core.x_command())), x_step + v_step / s.loop_hz + 1e-7);
      ASSERT_LE(std::abs(to_rad_s(bench.core.v_command())), v_step + 1e-5);
      ASSERT_LE(std::abs(to_nm(bench.core.f_command())), f_step + 1e-6);
      const double tau = s.J_n * (s.K_p * x_step + s.K_d * v_step + s.K_f * f_step);
      ASSERT_LE(std::abs(to_nm(bench.core.torque_command())), tau + 2e-3);
      ASSERT_NE(output.state, State::kTorque);
    }
  }
}

}  // namespace
}  // namespace farhand::mcu
