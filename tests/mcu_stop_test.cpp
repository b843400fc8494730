// The patient's stop, as an input of the MCU core: what it does from every state, and that nothing but the patient's
// own key ends it.
#include <gtest/gtest.h>

#include <random>

#include "common/device/mcu_si.hpp"
#include "slave/mcu/emulator.hpp"
#include "tests/support/mcu_bench.hpp"
#include "tests/support/unwinding.hpp"

namespace farhand::mcu {
namespace {

constexpr int kReleaseLoops = 200;  // 0.1 s
constexpr int kStopLoops = 4;       // 2 ms

class StopBench {
 public:
  explicit StopBench(const McuSettings& settings = with_ample_power()) : core(make_mcu_params(settings)) {}

  void send(Mode mode, double x_ref = 0, double v_ref = 0, double f_ref = 0) {
    std::uint8_t wire[kWireBytes];
    encode(make_command(mode, seq++, x_ref, v_ref, f_ref), wire);
    for (const std::uint8_t byte : wire) core.receive(byte);
  }
  // The joint is held; the motor winds the spring up to the torque that is commanded, at 40 rad/s at most.
  McuOutput loop() {
    constexpr double kSpring = McuSettings{}.spring;
    wound += std::clamp(to_nm(core.torque_command()) / kSpring - wound, -0.02, 0.02);
    return loop(counts_of(wound));
  }
  McuOutput loop(std::int32_t motor_counts) {
    McuInput input{0, motor_counts, 25, false};
    input.stop = stop;
    input.release = release;
    return output = core.step(input);
  }
  void loops(int count) {
    for (int i = 0; i < count; ++i) loop();
  }
  // Whole frame times, each with a frame of this mode.
  void frames(int count, Mode mode, double f_ref = 0) {
    for (int i = 0; i < count; ++i) send(mode, 0, 0, f_ref), loops(2);
  }
  void press_at_torque(double torque_nm) {
    frames(2, Mode::kSafe);
    frames(600, Mode::kTorque, torque_nm);
    pressed = to_nm(core.torque_command());
    ASSERT_NEAR(pressed, torque_nm, 0.01);
  }
  // The stop is up, the key pressed anew and held.
  void let_go() {
    stop = false, release = false;
    loops(1);
    release = true;
    loops(kReleaseLoops);
    release = false;
  }

  OrthosisMcu core;
  McuOutput output{};
  bool stop = false, release = false;
  std::uint8_t seq = 0;
  double wound = 0;    // rad, of the spring
  double pressed = 0;  // N m
};

TEST(PatientStop, RampsAnyTorqueToZeroInTwoMillisecondsAndStaysWhateverIsSent) {
  for (const double torque : {3.0, -3.0, 0.25}) {
    StopBench bench;
    bench.press_at_torque(torque);
    bench.stop = true;
    for (int k = 1; k <= kStopLoops; ++k) {
      bench.send(Mode::kTorque, 0, 0, torque);
      bench.loop();
      ASSERT_NEAR(to_nm(bench.core.torque_command()), bench.pressed * (1 - k / double{kStopLoops}), 1e-6) << k;
      ASSERT_EQ(bench.output.state, State::kFault);
    }
    ASSERT_EQ(bench.core.torque_command(), 0);
    bench.stop = false;  // letting the button up ends nothing
    bench.frames(300, Mode::kSafe);
    bench.frames(300, Mode::kTorque, torque);
    EXPECT_EQ(bench.core.torque_command(), 0);
    EXPECT_EQ(bench.output.state, State::kFault);
    EXPECT_EQ(bench.core.faults(), kPatientStop);
  }
}

TEST(PatientStop, LetsTheSpringGoSlackWhileItStands) {
  StopBench bench;
  bench.stop = true;
  bench.loops(10);
  EXPECT_NEAR(to_rad_s(bench.loop(100).motor_velocity), -10 * 10 * 100 * 2 * M_PI / 20000, 0.01);  // gain * k * stretch
}

// No torque is commanded 2 ms after the press. What the spring still has then is bounded by the motor's speed alone: a
// rigid hand is free as soon as any law could do it, within 7 ms; one that yields, within a quarter of its swing of it.
TEST(PatientStop, UnwindsTheSpringAsFastAsTheMotorTurns) {
  constexpr double kRigid = 1000;  // N m/rad
  for (const double inertia : {0.7, 1.0, 1.5}) {
    for (const double motor_speed : {4.0, 8.0}) {
      for (const double stiffness : {2.0, 5.0, 20.0, kRigid}) {
        for (const double torque : {0.3, 0.6, 1.0, 1.7, 2.9}) {
          if (torque / stiffness > 0.345) continue;
          OrthosisEmulator::Params p;
          p.mcu = with_ample_power();
          p.world.actuator.J *= inertia;
          p.world.actuator.motor_speed_limit = p.mcu.motor_speed_limit = motor_speed;
          p.world.environment.hand = Hand::Params{stiffness, 0.02, 0, 0, 1e9};
          OrthosisEmulator orthosis(p);
          std::uint8_t seq = 0, wire[kWireBytes];
          const auto loops = [&](int count) {
            for (int k = 0; k < count; ++k) orthosis.tick(wire);
          };
          const auto frame = [&](mcu::Mode mode, double f_ref) {
            encode(make_command(mode, seq++, 0, 0, f_ref), wire);
            for (const std::uint8_t byte : wire) orthosis.receive(byte);
            loops(2);
          };
          frame(mcu::Mode::kSafe, 0);
          for (int ms = 0; ms < 3000; ++ms) frame(mcu::Mode::kTorque, torque * std::min(1.0, ms / 1500.0));
          const double pressed = orthosis.world().truth().spring_torque;
          ASSERT_NEAR(pressed, torque, 0.01);
          orthosis.press_stop(true);
          loops(kStopLoops);
          ASSERT_EQ(orthosis.core().torque_command(), 0);
          double took = kStopLoops / p.mcu.loop_hz;
          for (; orthosis.world().truth().spring_torque > kUnwoundNm; took += 1 / p.mcu.loop_hz) loops(1);
          const double best = fastest_unwinding_s(p.world.actuator, stiffness, pressed);
          const double stop = p.mcu.stop_ramp_s, swing = swing_s(p.world.actuator, stiffness);
          const std::string name = std::to_string(pressed) + " N m on " + std::to_string(stiffness) +
                                   " N m/rad: " + std::to_string(1e3 * took) + " ms, at best " +
                                   std::to_string(1e3 * best);
          if (stiffness == kRigid) {
            EXPECT_GE(took, best - 0.001) << name;
            EXPECT_LE(took, best + kUnwindingLoopS) << name;
          }
          EXPECT_LE(took, best + stop + kUnwindingLoopS + swing) << name;
          if (inertia == 1 && motor_speed == 4) std::printf("%s\n", name.c_str());
        }
      }
    }
  }
}

TEST(PatientStop, EndsWhatSilenceLeftOpen) {
  StopBench bench;
  bench.press_at_torque(3);
  bench.loops(60);  // 10 ms into it
  bench.stop = true;
  bench.loops(kStopLoops);
  EXPECT_EQ(bench.core.torque_command(), 0);
  bench.frames(300, Mode::kTorque, 3);
  EXPECT_EQ(bench.output.state, State::kFault);
  EXPECT_EQ(bench.core.torque_command(), 0);
}

TEST(PatientStop, EndsByThePatientsKeyAndThenTheHostStartsFromSafe) {
  StopBench bench;
  bench.press_at_torque(1);
  bench.stop = true;
  bench.frames(50, Mode::kTorque, 1);
  bench.let_go();
  EXPECT_EQ(bench.core.faults(), 0);
  EXPECT_EQ(bench.output.state, State::kSafe);
  bench.frames(100, Mode::kTorque, 1);  // a host that goes on as if nothing had been
  EXPECT_EQ(bench.output.state, State::kSafe);
  EXPECT_EQ(bench.core.torque_command(), 0);
  bench.frames(1, Mode::kSafe);
  bench.frames(3, Mode::kTorque);
  EXPECT_EQ(bench.output.state, State::kTorque);
}

TEST(PatientStop, AKeyThatIsStuckOrHeldTooShortlyReleasesNothing) {
  StopBench bench;
  bench.press_at_torque(1);
  bench.release = true;  // stuck since before
  bench.stop = true;
  bench.loops(10);
  bench.stop = false;
  bench.loops(10 * kReleaseLoops);
  EXPECT_EQ(bench.core.faults(), kPatientStop);
  for (int i = 0; i < 20; ++i) {  // a contact that bounces
    bench.release = false, bench.loops(1);
    bench.release = true, bench.loops(kReleaseLoops - 1);
  }
  EXPECT_EQ(bench.core.faults(), kPatientStop);
  bench.stop = true, bench.release = false, bench.loops(2);  // pressed while the key is held
  bench.release = true, bench.loops(5 * kReleaseLoops);
  EXPECT_EQ(bench.core.faults(), kPatientStop);
  bench.let_go();
  EXPECT_EQ(bench.core.faults(), 0);
}

TEST(PatientStop, DoesNotReleaseOtherFaults) {
  StopBench bench;
  bench.loop();
  bench.loop(1000);  // 0.3 rad in a loop
  EXPECT_EQ(bench.core.faults(), kMotorEncoder);
  bench.stop = true, bench.loops(10);
  bench.let_go();
  EXPECT_EQ(bench.core.faults(), kMotorEncoder);
  EXPECT_EQ(bench.output.state, State::kFault);
  EXPECT_EQ(bench.output.motor_velocity, 0);
}

// Random presses, keys, frames, silences and garbage. Whatever comes: a pressed stop is latched, 2 ms later there is no
// torque until the patient's key was pressed anew and held, and after it only a SAFE frame leads out of SAFE.
TEST(PatientStop, NoSequenceOfEventsGetsAroundIt) {
  std::mt19937 random(21);
  StopBench bench;
  long stops = 0, releases = 0, active_loops = 0;
  int pressed_for = 0, held_for = 0;
  bool latched = false, key_was_up = false, safe_seen = false;
  Mode mode = Mode::kSafe;
  int until_next_mode = 0;
  for (int k = 0; k < 1'000'000; ++k) {
    if (bench.stop ? random() % 50 == 0 : random() % 2000 == 0) bench.stop = !bench.stop;
    if (random() % (bench.release ? 300 : 100) == 0) bench.release = !bench.release;
    if (until_next_mode-- == 0) {
      mode = static_cast<Mode>(random() % 4);
      until_next_mode = static_cast<int>(random() % 60);
    }
    if (k % 2 == 0 && mode != Mode::kConfig) {  // CONFIG stands for silence
      bench.send(mode, 0, 0, 2);
      if (mode == Mode::kSafe) safe_seen = true;
    } else if (random() % 100 == 0) {
      bench.core.receive(static_cast<std::uint8_t>(random()));
    }
    bench.loop();

    if (bench.stop) {
      if (!latched) ++stops;
      latched = true, pressed_for = held_for = 0, key_was_up = !bench.release;
    } else if (latched) {
      if (!bench.release) key_was_up = true, held_for = 0;
      held_for = key_was_up && bench.release ? held_for + 1 : 0;
      if (held_for == kReleaseLoops) latched = false, ++releases, safe_seen = false;
    }
    pressed_for = latched ? pressed_for + 1 : 0;
    ASSERT_EQ((bench.core.faults() & kPatientStop) != 0, latched) << k;
    if (latched) {
      ASSERT_EQ(bench.output.state, State::kFault) << k;
      if (pressed_for > kStopLoops) {
        ASSERT_EQ(bench.core.torque_command(), 0) << k;
      }
    }
    if (bench.output.state == State::kTorque || bench.output.state == State::kTrack) {
      ASSERT_TRUE(safe_seen) << k;
      ++active_loops;
    }
  }
  std::printf("%ld stops, %ld releases, %ld active loops\n", stops, releases, active_loops);
  EXPECT_GT(stops, 100);
  EXPECT_GT(releases, 100);
  EXPECT_GT(active_loops, 10'000);
}

// In the loop with the orthosis: pressed while the hand is pressed on, at any time within a loop.
TEST(PatientStop, TakesTheTorqueOffTheHand) {
  OrthosisEmulator::Params params;
  params.world.environment.hand = Hand::Params{5, 0.02, 0, 0, 1e9};
  params.mcu.spring_sensor_nm = 8;
  OrthosisEmulator orthosis(params);
  std::uint8_t seq = 0, wire[kWireBytes];
  const auto frames = [&](int count, Mode mode) {
    for (int i = 0; i < count; ++i) {
      encode(make_command(mode, seq++, 0, 0, mode == Mode::kTorque ? 1.5 : 0), wire);
      for (const std::uint8_t byte : wire) orthosis.receive(byte);
      orthosis.tick(wire), orthosis.tick(wire);
    }
  };
  frames(2, Mode::kSafe);
  frames(2000, Mode::kTorque);
  EXPECT_NEAR(orthosis.world().true_f(), 1.5, 0.02);
  orthosis.press_stop(true);
  frames(2, Mode::kTorque);
  EXPECT_EQ(orthosis.core().torque_command(), 0);
  frames(1000, Mode::kTorque);
  EXPECT_NEAR(orthosis.world().true_f(), 0, 0.02);
  EXPECT_EQ(orthosis.output().state, State::kFault);
  EXPECT_EQ(orthosis.core().faults(), kPatientStop);
}

TEST(SpringSensor, ThatDisagreesWithTheEncodersIsAFaultAfterTwentyMilliseconds) {
  for (const int sign : {1, -1}) {
    McuSettings settings;
    settings.spring_sensor_nm = 8;
    OrthosisMcu core(make_mcu_params(settings));
    McuInput input{};
    input.sensor = static_cast<std::int16_t>(sign * 32);  // 0.5 N m: still agrees
    for (int k = 0; k < 1000; ++k) core.step(input);
    EXPECT_EQ(core.faults(), 0);
    input.sensor = static_cast<std::int16_t>(sign * 33);
    for (int k = 0; k < 39; ++k) core.step(input);
    EXPECT_EQ(core.faults(), 0);
    input.sensor = 0;  // once again in agreement: counted anew
    core.step(input);
    input.sensor = static_cast<std::int16_t>(sign * 512);
    for (int k = 0; k < 39; ++k) core.step(input);
    EXPECT_EQ(core.faults(), 0);
    EXPECT_EQ(core.step(input).state, State::kFault);
    EXPECT_EQ(core.faults(), kSpringSensor);
  }
}

// The joint and the motor are apart by what a whole spring would show; the sensor says that there is no spring.
TEST(SpringSensor, FindsABrokenSpringUnderLoadAndTheMotorGoesOnlyWhereBothSay) {
  McuSettings settings;
  settings.spring_sensor_nm = 8;
  OrthosisMcu core(make_mcu_params(settings));
  McuInput input{};
  for (int counts = 0; counts <= 318; ++counts) {  // 0.1 rad: 1 N m
    input.motor_counts = counts;
    input.sensor = static_cast<std::int16_t>(counts * 64 / 318);
    core.step(input);
  }
  EXPECT_EQ(core.faults(), 0);
  input.sensor = 0;
  McuOutput output{};
  for (int k = 0; k < 40; ++k) output = core.step(input);
  EXPECT_EQ(core.faults(), kSpringSensor);
  EXPECT_EQ(output.motor_velocity, 0);
  input.sensor = 16;  // a quarter of a N m the same way: that much is taken off
  EXPECT_LT(core.step(input).motor_velocity, 0);
  input.sensor = -512;
  EXPECT_EQ(core.step(input).motor_velocity, 0);
}

TEST(McuRestart, IsTold) {
  OrthosisEmulator orthosis({});
  FrameDecoder decoder;
  SlowValues slow;
  const auto hear = [&] {
    std::uint8_t wire[kWireBytes];
    for (int k = 0; k < 40; ++k) {
      if (!orthosis.tick(wire)) continue;
      for (const std::uint8_t byte : wire) {
        if (decoder.push(byte)) slow.take(unpack_telemetry(decoder.payload()));
      }
    }
  };
  hear();
  EXPECT_EQ(slow.restart(), kPowerOn);
  orthosis.reset_mcu(kWatchdogReset);
  hear();
  EXPECT_EQ(slow.restart(), kWatchdogReset | (1 << 4));
  orthosis.reset_mcu(kBrownOut);
  hear();
  EXPECT_EQ(slow.restart(), kBrownOut | (2 << 4));
}

}  // namespace
}  // namespace farhand::mcu
