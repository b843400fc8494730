// TORQUE on the MCU: what bounds the torque that a host asks for, and the change between it and TRACK. The joint goes
// where the test moves it, as in a hand that is stronger than the device, or where the torque does.
#include <gtest/gtest.h>

#include <random>

#include "slave/mcu/emulator.hpp"
#include "tests/support/mcu_bench.hpp"
#include "tests/support/mcu_reference.hpp"

namespace farhand::mcu {
namespace {

// The core with a motor of 30 Hz behind its spring, at a joint that the test moves.
struct Grasped {
  explicit Grasped(const McuSettings& s = {}) : bench(s) {}

  // One loop; every second one a frame comes first.
  void loop(double x, Mode mode, double v_ref, double f_ref) {
    const double dt = 1 / bench.settings.loop_hz;
    if (loops++ % 2 == 0) bench.send(mode, x, v_ref, f_ref);
    motor_speed += -std::expm1(-2 * M_PI * 30 * dt) * (asked - motor_speed);
    motor += motor_speed * dt;
    const double before = spring;
    spring = bench.settings.spring * (motor - x);
    given = 0.5 * (spring + before) * (x - last);
    put_in = 0.5 * (spring + before) * motor_speed * dt;
    last = x;
    output = bench.loop(x, motor);
    asked = to_rad_s(output.motor_velocity);
  }
  void start(Mode mode, double x = 0) {
    motor = last = x;
    for (int k = 0; k < 4; ++k) loop(x, Mode::kSafe, 0, 0);
    for (int k = 0; k < 200; ++k) loop(x, mode, 0, 0);
  }
  double torque() const { return to_nm(bench.core.torque_command()); }

  Bench bench;
  McuOutput output{};
  double motor = 0, motor_speed = 0, asked = 0, last = 0, spring = 0, given = 0, put_in = 0;
  int loops = 0;
};

TEST(McuTorque, FollowsTheLawInDoublePrecisionToItsQuantisation) {
  const McuSettings s = with_ample_energy();
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

// The most that was put in during any stretch of time, beyond what was added in it.
struct Ledger {
  double power, most = 0, now = 0;
  void add(double given, double dt) {
    now = std::max(0.0, now + given - power * dt);
    most = std::max(most, now);
  }
};

// A hand that moves as strangely as it likes, and a host that pushes along, early or late.
struct Attack {
  double amplitude[3], rate[3], phase[3], pushes[4], lead;
};

// By the motor into the spring. The joint gets no more than that, less what the spring then holds.
double put_in(const Attack& a, const McuSettings& s) {
  Grasped hand(s);
  const auto motion = [&](double t) {
    double x = 0;
    for (int i = 0; i < 3; ++i) x += a.amplitude[i] * std::sin(a.rate[i] * t + a.phase[i]);
    return x;
  };
  hand.start(Mode::kTorque, motion(0));
  Ledger ledger{s.torque_power_w};
  double motor = 0, joint = 0;
  const double dt = 1 / s.loop_hz;
  for (int k = 0; k < 3000; ++k) {
    const double t = k * dt;
    const double v = (motion(t + a.lead + 1e-4) - motion(t + a.lead)) / 1e-4;
    const double push = a.pushes[(k / 750) % 4];
    hand.loop(motion(t), Mode::kTorque, v > 0 ? 8 : -8, v > 0 ? push : -push);
    ledger.add(hand.put_in, dt);
    motor += hand.put_in, joint += hand.given;
    EXPECT_LE(joint, motor + 0.01);  // trapezia of 0.5 ms
  }
  return ledger.most;
}

// Each finding is changed a little, and kept if it takes more.
TEST(McuTorque, NoSearchGetsMoreEnergyThanTheStoreAndItsRefill) {
  std::mt19937 random(3);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random()) / 4294967295.0;
  };
  for (const auto& [energy, power] : {std::pair(0.2, 2.0), {0.02, 0.5}, {0.5, 0.1}}) {
    McuSettings s;
    s.torque_energy_j = energy, s.torque_power_w = power;
    Attack best{};
    double most = 0;
    for (int n = 0; n < 400; ++n) {
      Attack a = best;
      const bool anew = n < 150;
      for (int i = 0; i < 3; ++i) {
        a.rate[i] = anew ? std::exp(uniform(0, 5)) : std::clamp(a.rate[i] * uniform(0.8, 1.25), 1.0, 150.0);
        const double largest = std::min(0.15, 1.5 / a.rate[i]);
        a.amplitude[i] = anew ? uniform(0, largest) : std::min(a.amplitude[i] * uniform(0.7, 1.4), largest);
        a.phase[i] += uniform(-0.5, 0.5) * (anew ? 6.3 : 1.0);
      }
      for (double& push : a.pushes) push = anew ? uniform(-4, 4) : std::clamp(push + uniform(-1, 1), -4.0, 4.0);
      a.lead = anew ? uniform(-0.02, 0.05) : a.lead + uniform(-0.005, 0.005);
      const double found = put_in(a, s);
      if (found > most) most = found, best = a;
    }
    std::printf("store %.2f J, %.1f W: at most %.4f J were put in\n", energy, power, most);
    EXPECT_LE(most, energy + 0.005);  // the motor stops 5 ms late: its own lag, at 1 W
    EXPECT_GE(most, 0.5 * energy);    // else nothing was searched
  }
}

// Pushed along at a constant speed for as long as one likes.
TEST(McuTorque, WhatIsGivenForLongIsThePowerAndNoMore) {
  for (const double power : {0.5, 2.0}) {
    for (const double v : {0.4, 1.5, -3.0}) {
      McuSettings s;
      s.torque_power_w = power;
      s.range_min = -1, s.range_max = 1;
      Grasped hand(s);
      const double x0 = v > 0 ? -0.9 : 0.9;
      hand.start(Mode::kTorque, x0);
      const double sign = v > 0 ? 1 : -1, dt = 1 / s.loop_hz;
      double x = x0, given = 0, second_half = 0;
      const int loops = static_cast<int>(0.6 / (std::abs(v) * dt));
      for (int k = 0; k < loops; ++k) {
        hand.loop(x += v * dt, Mode::kTorque, v, sign * 3);
        given += hand.given;
        if (k >= loops / 2) second_half += hand.given;
      }
      EXPECT_LE(given, s.torque_energy_j + power * loops * dt);
      if (std::abs(v) * 3 > 1.5 * power && loops * dt > 0.3) {
        EXPECT_NEAR(second_half / (loops * dt / 2), power, 0.25 * power) << v;
      }
    }
  }
}

// The store is emptied by pushing along; from there the hand turns back, against the push. With its last joules it
// winds the spring up to what is asked for: half at once, all of it 0.15 s later.
TEST(McuTorque, WhatBrakesIsWholeAndReversalIsNoStep) {
  McuSettings s;
  s.joint_counts_per_rev = s.motor_counts_per_rev = 0;
  s.torque_power_w = 0.3;
  for (const double sign : {1.0, -1.0}) {
    Grasped hand(s);
    double x = -sign * 0.3, v = sign;
    hand.start(Mode::kTorque, x);
    double before = 0, largest_step = 0, driving = 0;
    int braked_for = 0;
    for (int k = 0; k < 2200; ++k) {
      if (k >= 800) v = std::max(std::abs(v - sign) < 2 ? -1.0 : v * sign, v * sign - 0.01) * sign;  // 20 rad/s2
      x += v * 0.5e-3;
      if (x * sign < -0.3) break;
      hand.loop(x, Mode::kTorque, v, sign * 2);
      if (k > 50) largest_step = std::max(largest_step, std::abs(hand.torque() - before));
      before = hand.torque();
      if (k == 799) driving = hand.torque() * sign;
      if (v * sign < -0.2 && ++braked_for > 20) {
        // The spring is first wound up by what refills, and by the hand.
        ASSERT_GE(hand.torque() * sign, 1.0) << k;
        if (braked_for > 300) {
          ASSERT_NEAR(hand.torque() * sign, 2, 0.02) << k;
        }
      }
    }
    EXPECT_NEAR(driving, 0.3, 0.15);  // the power, at 1 rad/s
    EXPECT_GT(braked_for, 500);
    std::printf("pushing along %.3f N m of 2; largest step %.4f N m\n", driving, largest_step);
    EXPECT_LE(largest_step, 0.3 + 0.01);  // a frame of a reference
  }
}

// The orthosis without a hand, pushed as hard as a frame can say.
TEST(McuTorque, AFreeJointKeepsToItsTopSpeedAndItsRange) {
  for (const double sign : {1.0, -1.0}) {
    OrthosisEmulator::Params params;
    params.mcu = with_ample_energy(params.mcu);
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

// A hand that pulls to 0.5 rad: nothing pushes it, a spring of J_n K_p asks it back, and it is not held.
TEST(McuTorque, AHandThatPullsOutOfTheRangeIsAskedBackSoftly) {
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
    const double spring = params.mcu.J_n * params.mcu.K_p;
    EXPECT_NEAR(sign * orthosis.world().true_x(), (2 * 0.5 + spring * 0.349) / (2 + spring), 2e-3);
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
