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

}  // namespace
}  // namespace farhand
