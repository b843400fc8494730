// The firmware as it is flashed, on a simulated ATmega1284P in virtual time, in the loop with the simulated orthosis:
// what the core does on the PC and what it does on the chip are the same, bit by bit, and the chip has the time for it.
#include <gtest/gtest.h>

#include <random>

#include "common/device/mcu_si.hpp"
#include "tests/support/simavr_board.hpp"

namespace farhand {
namespace {

using mcu::Mode;
using mcu::State;

constexpr std::uint64_t kCyclesPerByte = 10 * mcu::kClockHz / mcu::kBaud;

struct References {
  Mode mode = Mode::kTrack;
  double x = 0, v = 0, f = 0;
};

// A PC that sends a frame every millisecond, and the core of the PC, which is fed with what the firmware's core was fed
// with and must answer with the same bits.
class Bench {
 public:
  explicit Bench(const SeriesElasticWorld::Params& world = {})
      : board(FARHAND_FIRMWARE, world), twin_(mcu::make_mcu_params(mcu::board_settings())) {
    board.on_loop = [this](const SimavrBoard::Loop& loop) { compare(loop); };
    board.on_byte = [this](std::uint8_t byte) { hear(byte); };
    board.on_reset = [this] { restart(); };
  }

  template <class Reference, class Each>
  void run(double until, const Reference& reference, const Each& each) {
    for (; now_ms < std::lround(until * 1e3); ++now_ms) {
      const double t = now();
      board.run_until(t);
      if (connected) {
        const References r = reference(t);
        std::uint8_t wire[mcu::kWireBytes];
        mcu::encode(mcu::make_command(r.mode, seq++, r.x, r.v, r.f), wire);
        board.send(wire, sizeof wire);
        ++sent;
      }
      each(t);
    }
    board.run_until(until);
  }
  template <class Reference>
  void run(double until, const Reference& reference) {
    run(until, reference, [](double) {});
  }
  void start() {
    const double t = now();
    run(t + 0.02, [](double) { return References{Mode::kSafe}; });
    run(t + 0.1, [](double) { return References{Mode::kTrack}; });
  }

  // Nothing of what ran may have differed.
  void expect_same() const {
    EXPECT_EQ(wrong_outputs, 0);
    EXPECT_EQ(wrong_bytes, 0);
    EXPECT_EQ(lost_telemetry, 0);
    EXPECT_EQ(told.crc_errors() + told.framing_errors(), 0);
  }
  void expect_in_time() const {
    const auto share = [](const SimavrBoard::Interrupt& i, double period) {
      return static_cast<double>(i.longest) / period;
    };
    const auto mean = [](const SimavrBoard::Interrupt& i) {
      return static_cast<double>(i.sum) / static_cast<double>(i.count);
    };
    const auto &loop = board.loop_interrupt(), &in = board.receive_interrupt(), &out = board.send_interrupt();
    std::printf(
        "loop: %llu of %d cycles at worst (%.1f %%), %.0f in the mean (%.1f %%); a byte in: %llu of %llu, out: "
        "%llu; stack left: %zu bytes\n",
        static_cast<unsigned long long>(loop.longest), mcu::kCyclesPerLoop, 100 * share(loop, mcu::kCyclesPerLoop),
        mean(loop), 100 * mean(loop) / mcu::kCyclesPerLoop, static_cast<unsigned long long>(in.longest),
        static_cast<unsigned long long>(kCyclesPerByte), static_cast<unsigned long long>(out.longest),
        board.stack_left());
    EXPECT_LE(share(loop, mcu::kCyclesPerLoop), 0.75);
    EXPECT_LE(share(in, kCyclesPerByte), 0.6);
    EXPECT_LE(share(out, kCyclesPerByte), 0.6);
    EXPECT_EQ(board.loops_late(), 0u);
    EXPECT_GT(board.stack_left(), 4096u);
  }
  const mcu::OrthosisMcu& core() const { return twin_; }
  double now() const { return static_cast<double>(now_ms) * 1e-3; }
  void skip_to_now() { now_ms = std::lround(std::ceil(board.now() * 1e3)); }

  SimavrBoard board;
  long now_ms = 5;  // by then the firmware listens
  long loops = 0, sent = 0, taken = 0, telemetry_frames = 0;
  int wrong_outputs = 0, wrong_bytes = 0, lost_telemetry = 0, restarts = 0;
  bool connected = true;
  std::uint8_t seq = 0;
  mcu::McuOutput output{};
  mcu::Telemetry telemetry;
  mcu::SlowValues slow;
  mcu::FrameDecoder told;  // what the PC hears
  std::uint8_t restart_page = mcu::kPowerOn;

 private:
  void compare(const SimavrBoard::Loop& loop) {
    ++loops;
    for (const std::uint8_t byte : loop.bytes) {
      twin_.receive(byte);
      taken += line_.push(byte);
    }
    output = twin_.step(loop.input);
    const bool same = output.motor_velocity == loop.output.motor_velocity && output.state == loop.output.state;
    if (!same && wrong_outputs++ == 0) {
      ADD_FAILURE() << "loop " << loops << ": " << output.motor_velocity << " on the PC, " << loop.output.motor_velocity
                    << " on the chip";
    }
    // The drive gets what the core says.
    const auto drive = mcu::drive_signal(loop.output.motor_velocity, mcu::duty_per_velocity(mcu::board_settings()));
    const double speed =
        (drive.positive ? 1 : -1) * drive.duty * mcu::board_settings().motor_speed_limit / mcu::kPwmTop;
    if (board.duty() != drive.duty || board.motor_command() != speed) ++wrong_outputs;
    std::uint8_t wire[mcu::kWireBytes];
    if (twin_.telemetry(wire)) expected_.insert(expected_.end(), wire, wire + sizeof wire);
  }
  void hear(std::uint8_t byte) {
    if (expected_.empty() || expected_.front() != byte) ++wrong_bytes;
    if (!expected_.empty()) expected_.pop_front();
    if (!told.push(byte)) return;
    const mcu::Telemetry frame = mcu::unpack_telemetry(told.payload());
    if (telemetry_frames > 0 && !restarted_ && frame.seq != ((telemetry.seq + 1) & 63)) ++lost_telemetry;
    restarted_ = false;
    telemetry = frame;
    slow.take(frame);
    ++telemetry_frames;
  }
  void restart() {
    ++restarts;
    twin_ = mcu::OrthosisMcu(mcu::make_mcu_params(mcu::board_settings()), restart_page);
    expected_.clear();
    told = {};
    restarted_ = true;
  }

  mcu::OrthosisMcu twin_;
  mcu::FrameDecoder line_;
  std::deque<std::uint8_t> expected_;
  bool restarted_ = false;
};

// What an ideal master sends in free motion: four channels drive both sides by a = -K_f f_m.
References sine(double t, double K_f = 125) {
  const double w = M_PI, phase = w * (t - 0.1);
  return {Mode::kTrack, 0.25 * std::sin(phase), 0.25 * w * std::cos(phase), 0.25 * w * w * std::sin(phase) / K_f};
}

TEST(Firmware, TenSecondsOfClosedLoopOnTheChipAreThoseOfThePcBitByBit) {
  constexpr double kUntil = 10;
  Bench bench;
  bench.start();
  double worst = 0;
  bench.run(
      kUntil, [](double t) { return sine(t); },
      [&](double t) {
        if (t > 1) worst = std::max(worst, std::abs(bench.board.world().true_x() - sine(t).x));
      });
  bench.expect_same();
  bench.expect_in_time();
  std::printf("%ld loops, %ld of %ld frames taken, %ld telemetry frames, worst tracking %.2f mrad\n", bench.loops,
              bench.taken, bench.sent, bench.telemetry_frames, worst * 1e3);
  // 14745600 / 7373 loops a second; the start-up copies 0.7 kB of data and the first loop comes one period after it.
  // The last frame may be on the line or just be decoded.
  EXPECT_NEAR(static_cast<double>(bench.loops), kUntil * mcu::kClockHz / mcu::kCyclesPerLoop, 3);
  EXPECT_GE(bench.taken, bench.sent - 2);
  EXPECT_EQ(bench.slow.crc_errors() + bench.slow.framing_errors(), 0);
  EXPECT_GE(bench.telemetry_frames, bench.loops / 2 - 1);
  EXPECT_EQ(bench.output.state, State::kTrack);
  EXPECT_LE(worst, 2e-3);
}

// It comes to rest with 5/0.2 = 25 rad/s.
SeriesElasticWorld::Params with_hand() {
  SeriesElasticWorld::Params world;
  world.environment.hand = Hand::Params{5, 0.2, 0, 0, 1e9};
  return world;
}
References let_go(double) { return {Mode::kSafe}; }
References press(double) { return {Mode::kTorque, 0, 0, 1.5}; }

// Pressed at any time within a millisecond while the hand is pressed on; 3 ms are one frame and 2 ms.
TEST(Firmware, ThePatientsStopIsZeroTorqueWithinAFrameAndTwoMilliseconds) {
  Bench bench(with_hand());
  double slowest_ms = 0;
  for (int n = 0; n < 8; ++n) {
    const double t0 = bench.now();
    bench.run(t0 + 0.005, let_go);
    bench.run(t0 + 0.2, press);
    ASSERT_GT(mcu::to_nm(bench.core().torque_command()), 1.0);
    const double pressed = t0 + 0.2 + n * 0.13e-3;
    bench.board.run_until(pressed);
    bench.board.press_stop(true);
    double zero = pressed;
    while (bench.core().torque_command() != 0 && zero < pressed + 0.02) bench.board.run_until(zero += 10e-6);
    slowest_ms = std::max(slowest_ms, (zero - pressed) * 1e3);
    bench.run(t0 + 0.23, press);
    EXPECT_EQ(bench.telemetry.state, State::kFault);
    EXPECT_EQ(bench.slow.faults(), mcu::kPatientStop);
    bench.board.press_stop(false);
    bench.run(t0 + 0.25, press);
    EXPECT_EQ(bench.telemetry.state, State::kFault);
    bench.board.press_release(true);
    bench.run(t0 + 0.36, press);
    EXPECT_EQ(bench.telemetry.state, State::kSafe);
    bench.board.press_release(false);
  }
  std::printf("from the press to zero torque: %.2f ms at most\n", slowest_ms);
  EXPECT_LE(slowest_ms, 3.0);
  bench.expect_same();
  bench.expect_in_time();
}

// 70 ms without supply: the drive stands, the spring keeps what it had, the counters keep their counts. Then the MCU is
// in SAFE at the angle where it is, says why it restarted, and waits for the edge.
TEST(Firmware, ABrownOutEndsInSafeAtTheRightAngleAndIsTold) {
  Bench bench(with_hand());
  bench.run(0.02, let_go);
  bench.run(0.7, press);
  const double x = bench.board.world().true_x();
  EXPECT_NEAR(x, 0.3, 2e-3);
  EXPECT_EQ(bench.slow.restart(), mcu::kPowerOn);
  for (int n = 1; n <= 2; ++n) {
    const double t0 = bench.now(), motor = bench.board.world().truth().motor_x;
    bench.restart_page = static_cast<std::uint8_t>(mcu::kBrownOut | (n << 4));
    bench.board.brown_out(0.07);
    EXPECT_EQ(bench.board.motor_command(), 0);
    EXPECT_FALSE(bench.board.drive_enabled());
    bench.skip_to_now();
    bench.run(t0 + 0.07, press);
    EXPECT_NEAR(bench.board.world().truth().motor_x, motor, 1e-3);
    bench.run(t0 + 0.4, press);
    EXPECT_EQ(bench.restarts, n);
    EXPECT_EQ(bench.telemetry.state, State::kSafe);
    EXPECT_EQ(bench.slow.restart(), bench.restart_page);
    EXPECT_NEAR(mcu::angle_rad(bench.telemetry), bench.board.world().true_x(), 1e-3);
    EXPECT_NEAR(bench.board.world().true_f(), 0, 0.02);
    bench.run(t0 + 0.41, let_go);
    bench.run(t0 + 1.1, press);
    EXPECT_EQ(bench.telemetry.state, State::kTorque);
    EXPECT_NEAR(bench.board.world().true_x(), x, 2e-3);
  }
  bench.expect_same();
}

TEST(Firmware, ALoopThatHangsIsResetByTheWatchdogWithinTwentyMilliseconds) {
  Bench bench(with_hand());
  bench.run(0.02, let_go);
  bench.run(0.3, press);
  EXPECT_TRUE(bench.board.drive_enabled());
  bench.restart_page = static_cast<std::uint8_t>(mcu::kWatchdogReset | (1 << 4));
  bench.board.freeze_loop();
  const double frozen = bench.now();
  bench.run(frozen + 0.02, press);
  EXPECT_EQ(bench.restarts, 1);
  bench.run(frozen + 0.3, press);
  EXPECT_EQ(bench.telemetry.state, State::kSafe);
  EXPECT_EQ(bench.slow.restart(), bench.restart_page);
  EXPECT_NEAR(bench.board.world().true_f(), 0, 0.02);
  bench.expect_same();
}

// A spring that has come off its sensor: the firmware reads the sensor and believes nothing.
TEST(Firmware, ASensorThatDisagreesWithTheEncodersEndsInFault) {
  Bench bench(with_hand());
  bench.run(0.02, let_go);
  bench.run(0.6, press);
  EXPECT_EQ(bench.telemetry.state, State::kTorque);
  EXPECT_NEAR(bench.slow.motor_current_a(), 1.0, 0.05);  // 1.5 N m
  EXPECT_EQ(bench.slow.temperature_c(), 25);
  bench.board.offset_sensor(-1);
  bench.run(0.7, press);
  EXPECT_EQ(bench.telemetry.state, State::kFault);
  EXPECT_EQ(bench.slow.faults(), mcu::kSpringSensor);
  EXPECT_EQ(bench.core().torque_command(), 0);
  bench.expect_same();
}

// Pushed along wherever a springy hand swings, in each mode and in a flight of changes between them: the bound acts,
// and every way through the core is taken.
TEST(Firmware, IsInTimeWithTheBoundActingInEveryMode) {
  SeriesElasticWorld::Params springy;
  springy.environment.hand = Hand::Params{60, 0.1, 0, 0, 1e9};
  for (const char* what : {"TRACK", "TORQUE", "changes", "ramps"}) {
    Bench bench(springy);
    bench.run(0.02, let_go);
    int bounded = 0;
    bench.run(
        1.0,
        [&](double t) {
          const double sign = bench.core().velocity() >= 0 ? 1 : -1;
          const long ms = std::lround(t * 1e3);
          Mode mode = what[1] == 'R' ? Mode::kTrack : Mode::kTorque;
          if (what[0] == 'c') mode = (ms / 3) % 2 == 0 ? Mode::kTrack : Mode::kTorque;
          if (what[0] == 'r' && ms % 60 < 8) return References{Mode::kSafe};
          return References{mode, sign, 8 * sign, (mode == Mode::kTrack ? -3.5 : 3.5) * sign};
        },
        [&](double) { bounded += bench.core().at_bound(); });
    std::printf("%s: bounded at %d ms of 980\n", what, bounded);
    EXPECT_GT(bounded, what[0] == 'r' ? 100 : what[0] == 'c' ? -1 : 400) << what;  // changes keep the torque
    bench.expect_same();
    bench.expect_in_time();
  }
}

// The line at its full rate, with what costs the most: frames whose CRC is wrong, random bytes, valid frames of random
// content. The loop is in time whatever comes, and so is every byte.
TEST(Firmware, IsInTimeWhateverComesOnTheLine) {
  Bench bench(with_hand());
  bench.start();
  std::mt19937 random(17);
  bench.connected = false;
  for (int ms = 0; ms < 500; ++ms) {
    std::uint8_t payload[mcu::kPayloadBytes], wire[12];
    for (auto& byte : payload) byte = static_cast<std::uint8_t>(random());
    payload[0] = static_cast<std::uint8_t>((payload[0] & 0x3F) | 0x40);  // TRACK
    mcu::encode_frame(payload, wire);
    wire[10] = static_cast<std::uint8_t>(random());
    wire[11] = 0;
    if (ms % 4 == 1) wire[3] = static_cast<std::uint8_t>(1 + random() % 255);
    if (ms % 4 == 2) {
      for (auto& byte : wire) byte = static_cast<std::uint8_t>(random());
    }
    bench.board.send(wire, ms % 4 == 3 ? 12 : 11);
    bench.run(bench.now() + 1e-3, press);
  }
  EXPECT_GT(bench.slow.crc_errors() + bench.slow.framing_errors(), 50);
  EXPECT_GT(bench.taken, 100);
  bench.expect_same();
  bench.expect_in_time();
}

}  // namespace
}  // namespace farhand
