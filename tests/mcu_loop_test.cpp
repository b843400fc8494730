// The MCU core in the loop with the simulated orthosis, through its serial cable, in virtual time.
#include <gtest/gtest.h>

#include <functional>

#include "common/device/mcu_si.hpp"
#include "slave/mcu/emulator.hpp"
#include "tests/support/mcu_reference.hpp"

namespace farhand {
namespace {

using mcu::Mode;
using mcu::State;

struct References {
  Mode mode = Mode::kTrack;
  double x = 0, v = 0, f = 0;
};

// A PC that sends references every millisecond and collects telemetry.
class Session {
 public:
  explicit Session(const OrthosisEmulator::Params& params = {}, double one_way_s = 1.5e-3)
      : orthosis(params, one_way_s) {}

  // until: time of this session, s. each: called after every millisecond.
  void run(double until, const std::function<References(double)>& references,
           const std::function<void(double)>& each = {}) {
    for (; now < from_seconds(until); now += kMillisecond) {
      const double t = to_seconds(now);
      if (connected) {
        const References r = references(t);
        std::uint8_t wire[mcu::kWireBytes];
        mcu::encode(mcu::make_command(r.mode, seq++, r.x, r.v, r.f), wire);
        orthosis.send(wire, sizeof wire, now);
      }
      orthosis.advance(now + kMillisecond - 1);
      std::uint8_t byte = 0;
      while (orthosis.receive(now + kMillisecond, byte)) {
        if (decoder.push(byte)) telemetry = mcu::unpack_telemetry(decoder.payload()), ++frames;
      }
      if (each) each(to_seconds(now + kMillisecond));
    }
  }
  void start(double at_x = 0) {
    run(0.02, [&](double) { return References{Mode::kSafe, at_x}; });
    run(0.1, [&](double) { return References{Mode::kTrack, at_x}; });
  }
  const SeriesElasticWorld& world() const { return orthosis.emulator().world(); }
  const mcu::OrthosisMcu& core() const { return orthosis.emulator().core(); }
  State state() const { return orthosis.emulator().output().state; }

  OrthosisOnSerial orthosis;
  Nanoseconds now = 0;
  std::uint8_t seq = 0;
  bool connected = true;
  mcu::FrameDecoder decoder;
  mcu::Telemetry telemetry;
  int frames = 0;
};

OrthosisEmulator::Params with_hand(double stiffness, double damping = 0.02) {
  OrthosisEmulator::Params params;
  params.world.environment.hand = Hand::Params{stiffness, damping, 0, 0, 1e9};
  return params;
}

// What an ideal master sends in free motion: four channels drive both sides by a = -K_f f_m, so f_m carries the
// acceleration.
References sine(double t, double K_f = 125) {
  const double w = M_PI, phase = w * (t - 0.1);
  return {Mode::kTrack, 0.25 * std::sin(phase), 0.25 * w * std::cos(phase), 0.25 * w * w * std::sin(phase) / K_f};
}

// Minimum-jerk ramp to `goal` from 0.1 s to 1.1 s.
References ramp(double t, double goal) {
  const double s = std::clamp(t - 0.1, 0.0, 1.0);
  return {Mode::kTrack, goal * s * s * s * (10 - 15 * s + 6 * s * s), goal * 30 * s * s * (1 - s) * (1 - s), 0};
}

TEST(SerialLine, AFrameTakes868MicrosecondsAndTheLatencyAndFramesQueue) {
  SerialLine line(1.5e-3);
  const std::uint8_t bytes[20] = {};
  line.send(bytes, 10, 0);
  line.send(bytes, 10, kMillisecond / 2);
  std::uint8_t byte;
  EXPECT_FALSE(line.receive(1'500'000 - 9 * 86'805 - 1, byte));
  EXPECT_TRUE(line.receive(1'500'000 - 9 * 86'805, byte));
  for (int i = 1; i < 9; ++i) EXPECT_TRUE(line.receive(1'499'999, byte));
  EXPECT_FALSE(line.receive(1'499'999, byte));
  EXPECT_TRUE(line.receive(1'500'000, byte));
  EXPECT_FALSE(line.receive(1'500'000 + 868'050 - 1, byte) && line.receive(1'500'000 + 868'050 - 1, byte) &&
               line.receive(0, byte));
  SerialLine none(0);
  none.send(bytes, 10, 7);
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(none.receive(7, byte));
}

TEST(McuLoop, TracksTheSineThroughTheSerialLine) {
  Session session;
  session.start();
  double worst = 0, worst_delayed = 0, square = 0;
  int count = 0;
  session.run(
      8.1, [](double t) { return sine(t); },
      [&](double t) {
        if (t < 1) return;
        const double error = session.world().true_x() - sine(t).x;
        worst = std::max(worst, std::abs(error));
        worst_delayed = std::max(worst_delayed, std::abs(session.world().true_x() - sine(t - 1.5e-3).x));
        square += error * error, ++count;
      });
  std::printf("tracking: worst %.3f mrad, RMS %.3f mrad; against the delayed reference %.3f mrad\n", worst * 1e3,
              std::sqrt(square / count) * 1e3, worst_delayed * 1e3);
  EXPECT_LE(worst, 2e-3);
  EXPECT_EQ(session.state(), State::kTrack);
}

TEST(McuLoop, PressesOnTheHandWithTheTorqueThatItReports) {
  for (const double sign : {1.0, -1.0}) {
    for (const double k : {0.5, 2.0, 5.0}) {
      Session session(with_hand(k));
      session.start();
      double lowest = 1, highest = -1, f_sum = 0, told_sum = 0;
      int count = 0;
      session.run(
          6.0,
          [&](double t) {
            References r = ramp(t, sign * 0.3);
            r.f = -k * r.x;  // the therapist presses as hard as the hand needs
            return r;
          },
          [&](double t) {
            if (t < 4) return;
            lowest = std::min(lowest, session.world().true_x());
            highest = std::max(highest, session.world().true_x());
            f_sum += session.world().true_f(), told_sum += mcu::torque_nm(session.telemetry), ++count;
          });
      std::printf("hand %.1f: x %.4f rad, f_s told/true %.4f, residual %.3f mrad\n", k, session.world().true_x(),
                  told_sum / f_sum, (highest - lowest) * 1e3);
      EXPECT_NEAR(told_sum / f_sum, 1, 0.01);
      EXPECT_NEAR(session.world().true_x(), sign * 0.3, 1e-3);
      EXPECT_LE(highest - lowest, 1e-3);
    }
  }
}

// f_ref = 0: a_ref = 0 at K_p (x_ref - x) = K_f k x.
TEST(McuLoop, YieldsToTheHandAsTheLawSays) {
  Session session(with_hand(5));
  session.start();
  session.run(5.0, [](double t) { return ramp(t, 0.3); });
  EXPECT_NEAR(session.world().true_x(), 400 * 0.3 / (400 + 125 * 5), 0.01 * 0.117);
}

TEST(McuLoop, RestsWithoutALimitCycle) {
  for (const double x : {0.0, 0.1, -0.2001}) {
    for (const double k : {0.0, 5.0}) {
      Session session(with_hand(k));
      session.start();
      double lowest = 1, highest = -1;
      session.run(
          6.0,
          [&](double t) {
            References r = ramp(t, x);
            r.f = -k * r.x;
            return r;
          },
          [&](double t) {
            if (t < 4) return;
            lowest = std::min(lowest, session.world().true_x());
            highest = std::max(highest, session.world().true_x());
          });
      std::printf("rest at %.2f rad, hand %.0f: peak to peak %.4f mrad\n", x, k, (highest - lowest) * 1e3);
      EXPECT_LE(highest - lowest, 1e-3);  // three counts; less than a fifth of what counts as stable
    }
  }
}

TEST(McuLoop, AWallIsStable) {
  OrthosisEmulator::Params params;
  params.world.environment.wall = Wall::Params{1000, 0.4, 0.1};
  Session session(params);
  session.start();
  double lowest = 1, highest = -1, f = 0, told = 0;
  session.run(
      6.0, [](double t) { return ramp(t, 0.25); },
      [&](double t) {
        if (t < 4) return;
        lowest = std::min(lowest, session.world().true_x());
        highest = std::max(highest, session.world().true_x());
        f = session.world().true_f(), told = mcu::torque_nm(session.telemetry);
      });
  std::printf("wall: %.4f mrad peak to peak, true %.4f N m, told %.4f N m\n", (highest - lowest) * 1e3, f, told);
  EXPECT_LE(highest - lowest, 5e-4);
  EXPECT_NEAR(f, 400 * 0.15 / 125, 0.02 * 0.48);  // K_p (x_ref - x) = K_f f
}

TEST(McuLoop, TorqueModePutsTheWantedTorqueOnTheHand) {
  for (const double torque : {0.8, -0.8}) {
    Session session(with_hand(5));
    session.run(0.02, [](double) { return References{Mode::kSafe}; });
    double most = 0;
    session.run(
        3.0,
        [&](double t) {
          return References{Mode::kTorque, 0, 0, t < 0.1 ? 0 : torque};
        },
        [&](double) { most = std::max(most, std::abs(session.world().true_f())); });
    EXPECT_EQ(session.state(), State::kTorque);
    EXPECT_NEAR(session.world().true_f(), torque, 4e-3);  // one count of each encoder is 3.1 mN m of spring
    EXPECT_NEAR(mcu::torque_nm(session.telemetry), torque, 4e-3);
    std::printf("torque mode: %.4f N m, peak %.3f\n", session.world().true_f(), most);
  }
}

// Without the master's force only K_p (x_ref - x) = a is left to accelerate the joint: the same law, seen from its
// error.
TEST(McuLoop, TrackingErrorWithoutForceReferenceIsTheAccelerationOverK_p) {
  Session session;
  session.start();
  double highest = 0;
  const auto references = [](double t) {
    References r = sine(t);
    r.f = 0;
    return r;
  };
  session.run(8.1, references, [&](double t) {
    if (t > 4) highest = std::max(highest, std::abs(session.world().true_x() - sine(t - 1.5e-3).x));
  });
  EXPECT_NEAR(highest, 0.25 * M_PI * M_PI / 400, 1.5e-3);
}

// Ideal encoders, so that a count that falls differently does not part the two runs.
TEST(McuLoop, ClosedLoopEqualsTheDoublePrecisionLaw) {
  OrthosisEmulator::Params params = with_hand(5);
  params.mcu.joint_counts_per_rev = params.mcu.motor_counts_per_rev = 0;
  params.world.actuator.joint_counts_per_rev = params.world.actuator.motor_counts_per_rev = 0;
  OrthosisEmulator emulator(params);
  mcu::McuReference law(params.mcu);
  SeriesElasticWorld world(params.world);
  double u = 0, x_ref = 0, v_ref = 0, f_ref = 0, worst_x = 0, worst_f = 0;
  std::uint8_t wire[mcu::kWireBytes], seq = 0;
  for (int k = 0; k < 10'000; ++k) {
    const double t = k * 0.5e-3;
    if (k % 2 == 0) {
      References r = ramp(t, 0.2);
      if (t > 3) r = sine(t + 0.1 - 3), r.x = 0.2 - 0.5 * r.x, r.v = -0.5 * r.v;
      r.f = -5 * r.x;
      const mcu::Command command = mcu::make_command(k < 10 ? Mode::kSafe : Mode::kTrack, seq++, r.x, r.v, r.f);
      mcu::encode(command, wire);
      for (const std::uint8_t byte : wire) emulator.receive(byte);
      const auto gate = [](double now, double goal, double step) { return std::clamp(goal, now - step, now + step); };
      x_ref = gate(x_ref, command.x_ref / 8192.0, 4e-3);
      v_ref = gate(v_ref, command.v_ref / 1024.0, 0.4);
      f_ref = gate(f_ref, command.f_ref / 2048.0, 0.3);
    } else {
      x_ref += v_ref * 0.5e-3;
    }
    if (k > 0) world.advance(u, k * 0.5e-3);
    law.estimate(world.encoder(), world.motor_encoder());
    u = law.control(x_ref, v_ref, f_ref, 3);
    emulator.tick(wire);
    worst_x = std::max(worst_x, std::abs(emulator.world().true_x() - world.true_x()));
    worst_f = std::max(worst_f, std::abs(mcu::to_nm(emulator.core().reaction_torque()) - law.f_s));
  }
  std::printf("fixed point against double, closed loop: x %.2f urad, f_s %.2f uN m\n", worst_x * 1e6, worst_f * 1e6);
  // Eight gains, each off by 2^-16 of itself at most, at 0.3 rad and 1.5 N m.
  EXPECT_LE(worst_x, 8 * 0.3 / 65536);
  EXPECT_LE(worst_f, 8 * 1.5 / 65536);
  EXPECT_NEAR(world.true_x(), 0.2, 0.01);
}

TEST(McuLoop, NothingMovesInSafeWhateverThePcSays) {
  Session session(with_hand(2));
  session.run(1.0, [](double) { return References{Mode::kSafe, 0.2, 1, 1}; });
  session.run(2.0, [](double t) {
    return References{std::lround(t * 1e3) % 3 == 0 ? Mode::kTrack : Mode::kTorque, 0.2, 0, -1};
  });
  EXPECT_EQ(session.state(), State::kSafe);
  EXPECT_NEAR(session.world().true_x(), 0, 1e-9);
  EXPECT_NEAR(session.frames, 1999, 2);
}

TEST(McuLoop, ThePatientMovesFreelyInSafe) {
  OrthosisEmulator::Params params;
  params.world.environment.hand =
      Hand::Params{2, 0.02, 0.25, 1.0, 1e9};  // a hand that wants to 0.25 rad, put in at 1 s
  Session session(params);
  double most = 0;
  session.run(
      4.0, [](double) { return References{Mode::kSafe}; },
      [&](double t) {
        if (t > 1.5) most = std::max(most, std::abs(session.world().truth().spring_torque));
      });
  EXPECT_NEAR(session.world().true_x(), 0.25, 2e-3);
  EXPECT_LE(most, 0.25);  // at up to 1.5 rad/s; the spring loop drags by v / (10 rad/s per N m)
  EXPECT_NEAR(session.world().truth().spring_torque, 0, 4e-3);  // one motor count
}

TEST(McuLoop, NothingJumpsAtTheStartOfTrack) {
  for (const double asked : {0.05, 0.2}) {  // where the joint is, and far from it
    Session session;
    session.run(0.02, [&](double) { return References{Mode::kSafe, asked}; });
    double x_command = 0, tau = 0, u = 0, x = 0;
    bool active = false;
    for (int k = 0; k < 400; ++k) {
      if (k % 2 == 0)
        session.run(to_seconds(session.now + kMillisecond), [&](double) { return References{Mode::kTrack, asked}; });
      const mcu::OrthosisMcu& core = session.core();
      if (session.state() == State::kTrack && !active) {
        active = true;
        EXPECT_NEAR(mcu::to_rad(core.x_command()), session.world().true_x(),
                    0.0042);  // at most one step after the start
        EXPECT_LE(std::abs(mcu::to_nm(core.torque_command())), 2 * 0.03 + 1e-6);
      }
      // Over the two loops of a millisecond: two loops of the start ramp and 8 mrad of the gate.
      EXPECT_LE(std::abs(mcu::to_rad(core.x_command()) - x_command), 0.0042);
      if (session.now < from_seconds(0.07)) {
        EXPECT_LE(std::abs(mcu::to_nm(core.torque_command()) - tau), 0.13);
      }
      EXPECT_LE(std::abs(session.world().true_x() - x), 4e-3);
      x_command = mcu::to_rad(core.x_command()), tau = mcu::to_nm(core.torque_command());
      u = mcu::to_rad_s(session.orthosis.emulator().output().motor_velocity), x = session.world().true_x();
    }
    EXPECT_TRUE(active);
    EXPECT_LE(std::abs(u), 4);
  }
  Session aligned;
  double most = 0;
  aligned.run(0.02, [](double) { return References{Mode::kSafe}; });
  aligned.run(
      1.0, [](double) { return References{}; },
      [&](double) { most = std::max(most, std::abs(aligned.world().true_x())); });
  EXPECT_EQ(aligned.state(), State::kTrack);
  EXPECT_LE(most, 1e-9);
}

TEST(McuLoop, ACutCableLetsGoAndOnlyTheEdgeBringsItBack) {
  Session session(with_hand(5));
  session.start();
  const auto press = [](double t) {
    References r = ramp(t, 0.3);
    r.f = -5 * r.x;
    return r;
  };
  session.run(3.0, press);
  const Nanoseconds arrived = session.now - kMillisecond + 1'500'000;  // of the last frame
  session.connected = false;
  double previous = mcu::to_nm(session.core().torque_command());
  ASSERT_NEAR(previous, 1.5, 0.02);
  for (Nanoseconds tick = session.now; tick < arrived + 100 * kMillisecond; tick += kMillisecond / 2) {
    session.orthosis.advance(tick);
    const Nanoseconds silent = tick - arrived;
    const double tau = mcu::to_nm(session.core().torque_command());
    if (silent >= 20 * kMillisecond) {
      ASSERT_LE(tau, previous + 1e-9);
      ASSERT_LE(previous - tau, 1.52 / 4 + 1e-6);
    }
    ASSERT_EQ(tau == 0.0, silent >= 21'500'000) << silent;
    const bool over = silent >= 69'500'000;
    ASSERT_EQ(session.state(), over ? State::kSafe : State::kTrack) << silent;
    ASSERT_EQ(session.core().faults(), over ? mcu::kWatchdog : 0) << silent;
    previous = tau;
  }
  session.now = arrived + 100 * kMillisecond;
  session.connected = true;
  session.run(4.0, press);  // the PC resumes as if nothing had been
  EXPECT_EQ(session.state(), State::kSafe);
  EXPECT_NEAR(session.world().truth().spring_torque, 0, 0.02);
  session.run(4.1, [](double) { return References{Mode::kSafe, 0}; });
  const double x = session.world().true_x();
  session.run(5.0, [&](double) { return References{Mode::kTrack, x, 0, 0}; });
  EXPECT_EQ(session.state(), State::kTrack);
  EXPECT_NEAR(session.world().true_x(), x, 2e-3);
}

TEST(McuLoop, AnMcuThatRestartsStaysSafeUntilTheEdge) {
  Session session(with_hand(2));
  session.start();
  const auto press = [](double t) {
    References r = ramp(t, 0.2);
    r.f = -2 * r.x;
    return r;
  };
  session.run(2.0, press);
  EXPECT_NEAR(session.world().true_x(), 0.2, 1e-3);
  session.orthosis.emulator().reset_mcu();
  session.run(3.0, press);
  EXPECT_EQ(session.state(), State::kSafe);
  EXPECT_EQ(session.telemetry.state, State::kSafe);  // the PC sees it
  EXPECT_NEAR(session.world().truth().spring_torque, 0, 4e-3);
  session.run(3.01, [](double) { return References{Mode::kSafe}; });
  session.run(5.0, [](double t) {
    References r = ramp(t - 2.91, 0.2);
    r.f = -2 * r.x;
    return r;
  });
  EXPECT_EQ(session.state(), State::kTrack);
  EXPECT_NEAR(session.world().true_x(), 0.2, 1e-3);
}

TEST(McuLoop, OneForgedFrameHardlyMovesTheJoint) {
  for (const double sign : {1.0, -1.0}) {
    Session session(with_hand(2));
    session.start();
    double before = 0, most = 0;
    const auto hold = [](double t) {
      References r = ramp(t, 0.2);
      r.f = -2 * r.x;
      return r;
    };
    session.run(3.0, hold);
    before = session.world().true_x();
    session.run(3.001, [&](double) { return References{Mode::kTrack, sign, 8 * sign, -4 * sign}; });
    session.run(4.0, hold, [&](double) { most = std::max(most, std::abs(session.world().true_x() - before)); });
    std::printf("a forged frame moves the joint by %.3f mrad\n", most * 1e3);
    EXPECT_LE(most, 2e-3);
    EXPECT_NEAR(session.world().true_x(), before, 3.2e-4);
  }
}

TEST(McuLoop, ANoisyCableCostsFramesAndNotTheSession) {
  Session session;
  session.start();
  std::uint32_t random = 1;
  double worst = 0;
  for (int ms = 0; ms < 6000; ++ms) {
    random = random * 1664525u + 1013904223u;
    if ((random >> 8) % 20 == 0) {  // noise on 5 % of the frames, both on its own and into the frame after it
      const std::uint8_t noise[2] = {static_cast<std::uint8_t>(random >> 24), static_cast<std::uint8_t>(random >> 16)};
      session.orthosis.send(noise, sizeof noise, session.now);
    }
    session.run(to_seconds(session.now + kMillisecond), [](double t) { return sine(t); });
    if (ms > 900) worst = std::max(worst, std::abs(session.world().true_x() - sine(to_seconds(session.now)).x));
  }
  std::printf("5 %% of the frames hit: worst error %.3f mrad, %d framing and %d CRC errors\n", worst * 1e3,
              session.core().decoder().framing_errors(), session.core().decoder().crc_errors());
  EXPECT_EQ(session.state(), State::kTrack);
  EXPECT_GT(session.core().decoder().framing_errors(), 200);
  EXPECT_LE(worst, 3e-3);
}

}  // namespace
}  // namespace farhand
