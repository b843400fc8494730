// The MCU core alone, fed with encoder counts and bytes: its arithmetic against double precision with bounds from the
// quantisation, its limits and what it finds implausible. Its states are in mcu_states_test.cpp.
#include <gtest/gtest.h>

#include <random>

#include "tests/support/mcu_bench.hpp"
#include "tests/support/mcu_reference.hpp"

namespace farhand::mcu {
namespace {

constexpr double kDelta = 1.0 / 65536;  // relative error of a Gain

TEST(McuCore, EncoderCountsAreAnglesToTwoUnits) {
  for (const double per_rev : {20000.0, 80000.0, 4096.0, 0.0}) {
    McuSettings settings;
    settings.joint_counts_per_rev = settings.motor_counts_per_rev = per_rev;
    for (double x = -3.9; x < 3.9; x += 0.0371) {
      Bench bench(settings);
      bench.loop(x, x);
      const double read = counts_of(x, per_rev) * encoder_unit_rad(per_rev);
      ASSERT_NEAR(to_rad(bench.core.angle()), read, 2.0 / (1 << kAngleBits)) << per_rev;
    }
  }
}

// Bounds. One angle unit is A, one velocity unit V, one torque unit T; every Gain is off by delta = 2^-16 of itself at
// most, every product by half a unit; a low-pass with factor a turns a rounding of e per step into e/a.
//   spring: delta |tau| + 2 k A + T         velocity: 2 delta |v| + (1/a_v + 2) (a_v/dt) A + V
//   observers: with U = |tau| + J g |v| as the largest input, 2 delta U for the filter and T/a for its rounding
TEST(McuCore, FollowsTheLawInDoublePrecisionToItsQuantisation) {
  const McuSettings s;
  Bench bench(s);
  McuReference reference(s);
  std::mt19937 random(7);
  const double dt = 1 / s.loop_hz, A = 1.0 / (1 << kAngleBits), V = 1.0 / (1 << kVelocityBits),
               T = 1.0 / (1 << kTorqueBits);
  const double a = s.g * dt / (1 + s.g * dt), a_v = s.g_v * dt / (1 + s.g_v * dt);
  double x_ref = 0, v_ref = 0, f_ref = 0, tau_allowed = 0, v_most = 0, tau_most = 0;
  double worst_v = 0, worst_f = 0, worst_tau = 0, worst_u = 0;
  bool active = false;
  for (int k = 0; k < 40'000; ++k) {
    const double t = k * dt;
    const double x = 0.25 * std::sin(M_PI * t) + 0.003 * std::sin(2 * M_PI * 23 * t);
    const double x_motor = x + 0.1 * std::sin(2 * M_PI * 1.7 * t);
    if (k % 2 == 0) {
      const Mode mode = k < 10 ? Mode::kSafe : Mode::kTrack;
      const Command command =
          make_command(mode, bench.seq++, 0.25 * std::sin(M_PI * (t - 0.002)),
                       0.25 * M_PI * std::cos(M_PI * (t - 0.002)), 0.8 * std::sin(2 * M_PI * 1.7 * t));
      const bool was_active = active;
      bench.send(command);
      active = k >= 14;
      if (active && !was_active) {  // the gate starts at what the core had estimated
        x_ref = reference.x, v_ref = reference.v, f_ref = -reference.f_s;
      } else if (active) {
        const auto gate = [](double now, double goal, double step) { return std::clamp(goal, now - step, now + step); };
        x_ref = std::clamp(gate(x_ref, command.x_ref / 8192.0, s.velocity_limit * 1e-3), s.range_min, s.range_max);
        v_ref = gate(v_ref, command.v_ref / 1024.0, s.acceleration_limit * 1e-3);
        f_ref = gate(f_ref, command.f_ref / 2048.0, s.force_rate_limit * 1e-3);
      }
    }
    const McuOutput output = bench.loop(x, x_motor);
    const double unit = encoder_unit_rad(s.joint_counts_per_rev);
    reference.estimate(counts_of(x) * unit, counts_of(x_motor) * unit);
    v_most = std::max(v_most, std::abs(reference.v));
    tau_most = std::max(tau_most, std::abs(reference.tau_spring));
    double u =
        std::clamp(reference.v - s.spring_gain * reference.tau_spring, -s.motor_speed_limit, s.motor_speed_limit);
    if (active) {
      if (k % 2 == 1) x_ref = std::clamp(x_ref + v_ref * dt, s.range_min, s.range_max);
      tau_allowed = std::min(tau_allowed + s.torque_limit / (s.ramp_s * s.loop_hz), s.torque_limit);
      u = reference.control(x_ref, v_ref, f_ref, tau_allowed);
    }

    const double e_spring = kDelta * tau_most + 2 * s.spring * A + T;
    const double e_v = 2 * kDelta * v_most + (1 / a_v + 2) * a_v / dt * A + V;
    const double Jg = s.J_n * s.g, U = tau_most + Jg * v_most;
    const double e_inertia = Jg * e_v + kDelta * Jg * v_most + T;
    const double e_dis = 2 * e_inertia + e_spring + 2 * kDelta * U + T / a;
    const double e_f = e_dis + s.viscous * e_v + T;
    // References: exact after the first frames, then half a unit and delta |v| dt per interpolation.
    const double e_tau = s.J_n * (s.K_p * (3 * A + kDelta * dt) + s.K_d * (e_v + V) + s.K_f * (e_f + T)) + e_dis +
                         kDelta * (0.02 * 1.6 + 0.16 * 2 * v_most + 0.5 * (0.8 + tau_most)) + 4 * T + T * 200;
    const double e_u = e_v + s.spring_gain * (e_tau + e_spring) + kDelta * s.motor_speed_limit + V;
    ASSERT_NEAR(to_nm(bench.core.spring_torque()), reference.tau_spring, e_spring) << t;
    ASSERT_NEAR(to_rad_s(bench.core.velocity()), reference.v, e_v) << t;
    ASSERT_NEAR(to_nm(bench.core.disturbance_torque()), reference.tau_dis, e_dis) << t;
    ASSERT_NEAR(to_nm(bench.core.reaction_torque()), reference.f_s, e_f) << t;
    if (k < 100) continue;  // the gate started from estimates, not from exact references
    ASSERT_EQ(output.state, State::kTrack);
    ASSERT_NEAR(to_rad(bench.core.x_command()), x_ref, 3 * A + kDelta * dt) << t;
    ASSERT_NEAR(to_nm(bench.core.torque_command()), reference.tau_command, e_tau) << t;
    ASSERT_NEAR(to_rad_s(output.motor_velocity), u, e_u) << t;
    worst_v = std::max(worst_v, std::abs(to_rad_s(bench.core.velocity()) - reference.v));
    worst_f = std::max(worst_f, std::abs(to_nm(bench.core.reaction_torque()) - reference.f_s));
    worst_tau = std::max(worst_tau, std::abs(to_nm(bench.core.torque_command()) - reference.tau_command));
    worst_u = std::max(worst_u, std::abs(to_rad_s(output.motor_velocity) - u));
  }
  // Far below what a count of the telemetry shows (0.1 mN m) and an encoder count does (63 mrad/s).
  EXPECT_LT(worst_f, 1e-4);
  std::printf("worst: v %.2g rad/s, f_s %.2g N m, torque %.2g N m, motor %.2g rad/s\n", worst_v, worst_f, worst_tau,
              worst_u);
}

TEST(McuCore, TheReferenceMovesOnOnceBetweenFramesAndThenWaits) {
  Bench bench;
  bench.activate(Mode::kTrack);
  for (int i = 0; i < 10; ++i) bench.send(Mode::kTrack, 0, 1.0), bench.frame_time();
  bench.send(Mode::kTrack, 0.001, 1.0);
  bench.loop();
  EXPECT_NEAR(to_rad(bench.core.x_command()), 8 / 8192.0, 1e-6);
  bench.loop();
  EXPECT_NEAR(to_rad(bench.core.x_command()), 8 / 8192.0 + 0.0005, 1e-6);
  for (int k = 0; k < 30; ++k) bench.loop();
  EXPECT_NEAR(to_rad(bench.core.x_command()), 8 / 8192.0 + 0.0005, 1e-6);
}

TEST(McuCore, ReferencesStayInsideTheRange) {
  McuSettings settings;
  settings.range_min = -0.1, settings.range_max = 0.2;
  for (const double sign : {1.0, -1.0}) {
    Bench bench(settings);
    bench.activate(Mode::kTrack);
    for (int i = 0; i < 500; ++i) bench.send(Mode::kTrack, sign * 0.9, sign * 3), bench.frame_time();
    EXPECT_NEAR(to_rad(bench.core.x_command()), sign > 0 ? 0.2 : -0.1, 1e-7);
  }
}

// What a frame can say beyond the limits is cut before anything remembers it.
TEST(McuCore, ReferencesStayWithinTheLimits) {
  McuSettings settings;
  settings.velocity_limit = 2, settings.torque_limit = 1.5;
  for (const Mode mode : {Mode::kTrack, Mode::kTorque}) {
    for (const double sign : {1.0, -1.0}) {
      Bench bench(settings);
      bench.activate(mode);
      for (int i = 0; i < 100; ++i) bench.send(mode, 0, sign * 8, sign * 4), bench.frame_time();
      EXPECT_NEAR(to_rad_s(bench.core.v_command()), sign * 2, 1e-6);
      EXPECT_NEAR(to_nm(bench.core.f_command()), sign * 1.5, 1e-6);
    }
  }
}

TEST(McuCore, AStartBeyondTheRangeWalksIntoItByTheStepsOfAFrame) {
  Bench bench;
  const double x = 0.5, step = bench.settings.velocity_limit * 1e-3;
  bench.send(Mode::kSafe, x);
  bench.frame_time(x, x);
  double before = 0;
  for (int frame = 0; frame < 100; ++frame) {
    bench.send(Mode::kTrack, x, 0.5);
    for (int loop = 0; loop < 2; ++loop) {
      bench.loop(x, x);
      const double now = to_rad(bench.core.x_command());
      if (frame > 2) {
        ASSERT_LE(std::abs(now - before), step + 1e-6) << frame;
      }
      before = now;
    }
  }
  EXPECT_NEAR(before, bench.settings.range_max, 1e-6);
}

TEST(McuCore, TorqueIsLimitedInSizeAndRate) {
  McuSettings settings = with_ample_power();
  settings.torque_limit = 1.5, settings.torque_rate_limit = 100;
  for (const double sign : {1.0, -1.0}) {
    Bench bench(settings);
    bench.activate(Mode::kTorque);
    double previous = 0;
    for (int i = 0; i < 400; ++i) {
      bench.send(Mode::kTorque, 0, sign * 8, sign * 3.9);
      for (int half = 0; half < 2; ++half) {
        bench.held_loop();
        const double tau = to_nm(bench.core.torque_command());
        ASSERT_LE(std::abs(tau - previous), 0.05 + 1e-7);
        ASSERT_LE(std::abs(tau), 1.5);
        previous = tau;
      }
    }
    EXPECT_EQ(previous, sign * 1.5);
  }
}

TEST(McuCore, AnEncoderJumpStopsTheMotorUntilReset) {
  for (const bool joint : {true, false}) {
    Bench bench;
    bench.activate(Mode::kTrack);
    const double jump = 0.08;  // 150 rad/s is 0.075 rad per loop
    McuOutput output = bench.loop(joint ? jump : 0, joint ? 0 : jump);
    EXPECT_EQ(output.state, State::kFault);
    EXPECT_EQ(output.motor_velocity, 0);
    EXPECT_EQ(bench.core.faults(), joint ? kJointEncoder : kMotorEncoder);
    for (int i = 0; i < 500; ++i) {
      bench.send(i < 250 ? Mode::kSafe : Mode::kTrack, 0.1);
      output = bench.frame_time();
      ASSERT_EQ(output.state, State::kFault);
      ASSERT_EQ(output.motor_velocity, 0);
    }
    bench.core = OrthosisMcu(make_mcu_params(bench.settings));
    EXPECT_EQ(bench.loop().state, State::kSafe);
  }
}

// What an encoder missed while it stood comes back as one step, of 35 rad/s here; followed, it would throw the motor
// ahead of the hand.
TEST(McuCore, AJointIsNotBelievedFasterThanItsLimitWhateverItsEncoderMissed) {
  for (const double v : {-3.5, 3.5, 8.0}) {
    Bench b;
    const double fastest = kFastest * b.settings.velocity_limit, believed = std::fmin(std::fmax(v, -fastest), fastest);
    double x = 0;
    const auto move = [&](int loops, bool stands) {
      const double shown = x;
      for (int i = 0; i < loops; ++i) {
        x += v / b.settings.loop_hz;
        b.loop(stands ? shown : x, x);
        ASSERT_LE(std::fabs(to_rad_s(b.core.velocity())), fastest + 1e-3) << v;
      }
    };
    move(40, false);
    EXPECT_NEAR(to_rad_s(b.core.velocity()), believed, 0.2) << v;
    move(10, true);
    EXPECT_LT(std::fabs(to_rad_s(b.core.velocity())), 0.12 * std::fabs(believed)) << v;
    move(20, false);  // five times its filter's time
    EXPECT_NEAR(to_rad_s(b.core.velocity()), believed, 0.2) << v;
  }
}

TEST(McuCore, CountsOutsideFourRadiansAreImplausible) {
  for (const std::int32_t counts : {INT32_MIN, -13000, 13000, INT32_MAX}) {
    Bench bench;
    EXPECT_EQ(bench.core.step({counts, 0, 0, false}).state, State::kFault);
    EXPECT_EQ(bench.core.step({0, counts, 0, false}).motor_velocity, 0);
  }
}

TEST(McuCore, TooMuchSpringTorqueIsLatchedAndRelieved) {
  Bench bench;
  bench.activate(Mode::kTrack);
  for (int i = 0; i < 40; ++i) bench.frame_time(0, 0.61 * i / 40), bench.send(Mode::kTrack);
  EXPECT_EQ(bench.core.faults(), 0);
  bench.frame_time(0, 0.61);
  EXPECT_EQ(bench.core.faults(), kSpringTorque);
  for (int k = 0; k < 120; ++k) bench.loop(0, 0.61);
  const McuOutput output = bench.loop(0, 0.61);
  EXPECT_EQ(output.state, State::kFault);
  EXPECT_LT(to_rad_s(output.motor_velocity), -1.0);
}

TEST(McuCore, OverrunsAreCountedAndARunOfThemIsAFault) {
  Bench bench;
  bench.activate(Mode::kTrack);
  for (int i = 0; i < 200; ++i) bench.send(Mode::kTrack), bench.loop(0, 0, i % 10 != 0), bench.loop(0, 0, false);
  EXPECT_EQ(bench.core.faults(), 0);
  for (int k = 0; k < 20; ++k) bench.send(Mode::kTrack), bench.loop(0, 0, true);
  EXPECT_EQ(bench.core.faults(), kOverrun);
}

TEST(McuCore, SurvivesAnyInputWithBoundedOutput) {
  std::mt19937 random(11);
  for (int run = 0; run < 200; ++run) {
    McuSettings settings;
    settings.encoder_speed_fault = 4000;  // so that wild angles reach the arithmetic
    settings.spring_torque_fault = 15;
    Bench bench(settings);
    for (int k = 0; k < 500; ++k) {
      bench.send(k < 4 ? Mode::kSafe : Mode::kTrack, static_cast<double>(random() % 2000) * 1e-3 - 1,
                 static_cast<double>(random() % 16) - 8, static_cast<double>(random() % 8) - 4);
      if (run % 2) bench.core.receive(static_cast<std::uint8_t>(random()));
      const double centre = run % 3 ? 0 : 3.9;
      const McuOutput output = bench.core.step({counts_of(centre) + static_cast<std::int32_t>(random() % 5000) - 2500,
                                                counts_of(centre) + static_cast<std::int32_t>(random() % 5000) - 2500,
                                                static_cast<std::int8_t>(random()), random() % 4 == 0});
      ASSERT_LE(std::abs(to_rad_s(output.motor_velocity)), settings.motor_speed_limit);
      ASSERT_LE(std::abs(to_nm(bench.core.torque_command())), settings.torque_limit);
    }
  }
}

TEST(McuCore, TelemetrySaysWhatTheCoreKnowsAtHalfTheLoopRate) {
  Bench bench;
  bench.activate(Mode::kTrack, 0.2);
  FrameDecoder decoder;
  SlowValues slow;
  int frames = 0;
  std::uint8_t wire[kWireBytes];
  bench.core.receive(7), bench.core.receive(0);
  for (int k = 0; k < 200; ++k) {
    if (k % 2 == 0) bench.send(Mode::kTrack, 0.2);
    const McuOutput output = bench.loop(0.2, 0.24, k % 50 == 0);
    if (!bench.core.telemetry(wire)) continue;
    ++frames;
    bool complete = false;
    for (const std::uint8_t byte : wire) complete = decoder.push(byte);
    ASSERT_TRUE(complete);
    const Telemetry telemetry = unpack_telemetry(decoder.payload());
    slow.take(telemetry);
    const SlowPage page = slow_page(telemetry.seq);
    if (page == SlowPage::kCommandEcho) {
      ASSERT_EQ(slow.command_seq(), (bench.seq - 1) & 15);
    }
    if (page == SlowPage::kMotorSpeedCommand) {
      ASSERT_NEAR(slow.motor_speed_command_rad_s(), to_rad_s(output.motor_velocity), 0.5 / 16);
    }
    ASSERT_EQ(telemetry.state, State::kTrack);
    ASSERT_NEAR(angle_rad(telemetry), 0.2, 1.6e-4 + 0.5e-4);
  }
  EXPECT_EQ(frames, 100);
  EXPECT_NEAR(slow.spring_torque_nm(), 0.4, 10 * 3.2e-4);
  EXPECT_NEAR(slow.motor_angle_rad(), 0.24, 1.6e-4 + 0.5e-4);
  EXPECT_EQ(slow.temperature_c(), 25);
  EXPECT_EQ(slow.faults(), 0);
  EXPECT_EQ(slow.framing_errors(), 1);
  EXPECT_EQ(slow.crc_errors(), 0);
  EXPECT_EQ(slow.overruns(), 4);
  EXPECT_EQ(slow.firmware(), 7);
  EXPECT_EQ(slow.restart(), kPowerOn);
}

// Each once, on the next page after it; and what did not happen is not told.
TEST(McuCore, TellsThatItsBoundActedAndThatSilenceLetGo) {
  Bench bench;
  FrameDecoder decoder;
  SlowValues slow;
  int pages = 0, bounded = 0, sagged = 0;
  const auto hear = [&](int loops) {
    pages = bounded = sagged = 0;
    for (int k = 0; k < loops; ++k) {
      bench.held_loop();
      std::uint8_t wire[kWireBytes];
      if (!bench.core.telemetry(wire)) continue;
      for (const std::uint8_t byte : wire) {
        if (!decoder.push(byte)) continue;
        const Telemetry telemetry = unpack_telemetry(decoder.payload());
        slow.take(telemetry);
        if (slow_page(telemetry.seq) != SlowPage::kCommandEcho) continue;
        ++pages;
        bounded += (slow.happened() & kBounded) != 0, sagged += (slow.happened() & kSagged) != 0;
      }
    }
  };
  const auto frames = [&](int count, double f_ref) {
    int all[3] = {};
    for (int i = 0; i < count; ++i) {
      bench.send(Mode::kTorque, 0, 0, f_ref);
      hear(2);
      all[0] += pages, all[1] += bounded, all[2] += sagged;
    }
    pages = all[0], bounded = all[1], sagged = all[2];
  };
  bench.activate(Mode::kTorque);
  frames(160, 0.05);
  EXPECT_EQ(pages, 10);
  EXPECT_EQ(bounded + sagged, 0);
  frames(4, 3), frames(16, 3);  // 3 N m at once are 375 rad/s2, and the bound is 88
  EXPECT_EQ(bounded, 1);
  frames(200, 0);
  for (int n = 0; n < 5; ++n) {
    hear(60);
    int told = sagged;
    frames(40, 0), told += sagged;
    EXPECT_EQ(told, 1) << n;
  }
  hear(400);
  EXPECT_EQ(sagged, 1);
  EXPECT_EQ(slow.faults(), kWatchdog);
  hear(400);
  EXPECT_EQ(bounded + sagged, 0);
}

TEST(McuCore, TellsTheNumberOfTheNewestCommandInTwelveBitsWhateverWasLostBefore) {
  Bench bench;
  unsigned number = 4000;
  int told = 0;
  for (unsigned k = 0; k < 1000; ++k) {
    const bool safe = k % 100 < 10;
    Command command = make_command(safe ? Mode::kSafe : k % 100 < 50 ? Mode::kTrack : Mode::kTorque, 0, 0, 0, 0);
    // After a SAFE frame up to fourteen in a row may get lost; before one any number.
    number = (number + (k % 100 == 0 ? 1000 : k % 11 == 0 ? 15 : 1)) % kNumbers;
    set_number(command, static_cast<std::uint16_t>(number));
    bench.send(command);
    if (k % 7 == 3) bench.send(make_command(Mode::kConfig, 9, 0.1, 0, 0));
    bench.loop();
    bench.loop();
    Telemetry frame;
    ASSERT_TRUE(bench.core.telemetry(frame));
    const SlowPage page = slow_page(frame.seq);
    if (page != SlowPage::kNumberHigh && page != SlowPage::kNumberLow) continue;
    ASSERT_EQ(frame.slow, page == SlowPage::kNumberHigh ? number >> 4 & 255 : number & 255) << k;
    ++told;
  }
  EXPECT_EQ(told, 2 * (1000 / 16));
}

}  // namespace
}  // namespace farhand::mcu
