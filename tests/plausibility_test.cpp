// Readings that cannot be, in both directions of motion: jump and frozen against closed forms, and no word about what
// an axis can do.
#include "common/observer/plausibility.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <random>

#include "common/observer/rtob.hpp"
#include "common/signal/derivative.hpp"

namespace farhand {
namespace {

using J1 = Joints<1>;
constexpr double kJ = 4e-3, kDt = 1e-3, kTop = 3.0;
constexpr PlausibilityParams kJoint{.resolution = 1e-3, .top_acceleration = 1000};

class EitherWay : public ::testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Plausibility, EitherWay, ::testing::Values(1.0, -1.0));

// At rest the last count may have been half way: 2 q + a dt^2, and n missed ticks give n times the time.
TEST_P(EitherWay, JumpIsWhatTopAccelerationDoesNotReach) {
  for (const int ticks : {1, 2, 10, 100}) {
    const double time = kDt * ticks;
    const double reach = time + 0.5 * 1000 * (time + kDt) * time + 1e-3;  // q/dt remembered as speed
    for (const double jump : {0.999 * reach, 1.001 * reach}) {
      if (jump > 0.5) continue;
      Plausibility joint(kJoint);
      joint.step({0});
      joint.step({0});
      EXPECT_EQ(joint.step({GetParam() * jump}, 1, ticks), jump > reach ? Implausible::kJump : Implausible::kNo);
    }
  }
}

TEST(Plausibility, AReadingThatIsRepeatedHasTheTimeOfAllItsTicks) {
  Plausibility joint(kJoint);
  joint.step({0});
  for (int k = 0; k < 30; ++k) EXPECT_EQ(joint.step({0}, 0), Implausible::kNo);
  EXPECT_EQ(joint.step({0.1}), Implausible::kNo);
  EXPECT_EQ(joint.step({0.2}), Implausible::kJump);
}

// At a steady speed, an encoder of 0.3 mrad that freezes at any moment between two counts.
TEST_P(EitherWay, FrozenInMotionIsFoundWithinMilliseconds) {
  constexpr double q = 3.14e-4;
  for (const double v : {0.3, 0.5, 0.6, 0.7, 1.0, 4.0}) {
    int slowest = 0;
    bool always = true;
    for (double phase = 0; phase < 1; phase += 0.02) {
      Plausibility joint({.resolution = q});
      double x = 0;
      for (int k = 0; k < 20; ++k) {
        x = GetParam() * q * std::floor(v * kDt * k / q + phase);
        ASSERT_EQ(joint.step({x}), Implausible::kNo);
      }
      int n = 1;
      while (joint.step({x}) == Implausible::kNo && n < 50) ++n;
      always &= n < 50;
      slowest = std::max(slowest, n);
    }
    std::printf("at %.1f rad/s: %s\n", v, always ? (std::to_string(slowest) + " ms").c_str() : "not always");
    // Of v, 2 q in 4 ms may be counts, and of its change 2 q in (4 ms)^2; what is left must get by 2 q within 4 ms of a
    // hand whose damping slows it by exp(-2 w t), w = 100/s.
    const double t = 4e-3, left = (v - 2 * q / 4e-3) * t * std::exp(-200 * t) - q / 16e-6 * t * t;
    if (left < 2 * q) continue;
    EXPECT_TRUE(always) << v;
    EXPECT_LE(slowest, 4) << v;
  }
}

// Behind friction a spring of K yields df/K: what moves it by less than two counts may act for ever; near a stop
// anything.
TEST_P(EitherWay, FrozenIsNotWhatTheStiffestHandHoldsWithinTwoCounts) {
  for (const double share : {0.99, 1.01}) {
    Plausibility joint(kJoint), at_stop(kJoint);
    const double df = GetParam() * (kJoint.friction + share * kJoint.stiffness * 2 * kJoint.resolution);
    LowPass<1> observer(kJoint.g_reac, kJoint.dt_s);
    bool frozen = false;
    for (int k = 0; k < 10'000; ++k) {
      const double f = observer.step(J1(k < 100 ? 0 : df))[0];
      frozen |= joint.step({0.1, f}) == Implausible::kFrozen;
      EXPECT_EQ(at_stop.step({0.34, 10 * f}), Implausible::kNo);
    }
    EXPECT_EQ(frozen, share > 1);
  }
}

// Without spring and damper z = df dt^2 n (n + 1) / 2 J (critical damping of no spring is none).
TEST_P(EitherWay, FrozenIsWhatWouldHaveYieldedByTwoCounts) {
  for (const double df : {0.05, 0.3, 2.0}) {
    PlausibilityParams p = kJoint;
    p.stiffness = p.damping = p.friction = 0;
    Plausibility joint(p);
    LowPass<1> observer(p.g_reac, p.dt_s);
    observer.reset(J1(0.2));
    for (int k = 0; k < 60; ++k) ASSERT_EQ(joint.step({0.1, 0.2}), Implausible::kNo);
    int n = 0;
    const J1 tau(0.2 + GetParam() * df);
    while (joint.step({0.1, observer.step(tau)[0]}) == Implausible::kNo && n < 1000) ++n;
    const double needed = 2 * p.resolution * p.inertia / (1e-6 * df);
    EXPECT_EQ(n, static_cast<int>(std::floor((std::sqrt(1 + 8 * needed) - 1) / 2))) << df;
    EXPECT_EQ(joint.step({0.1, observer.step(tau)[0]}), Implausible::kNo) << "judged anew";
  }
}

// A serial adapter keeps frames back and then hands them over at once: what lies between two readings is what the
// device counted, not what passed between their arrivals.
TEST(Plausibility, ALateReadingAndTheNextInTimeAreNoJump) {
  constexpr double kWay = 2e-3;  // rad in a period
  for (const int counted : {1, 8}) {
    Plausibility joint(kJoint);
    int k = 0;
    for (; k < 40; ++k) ASSERT_EQ(joint.step({kWay * k}), Implausible::kNo);
    for (int late = 0; late < 7; ++late) ASSERT_EQ(joint.step({kWay * (k - 1)}, 0), Implausible::kNo);
    ASSERT_EQ(joint.step({kWay * k}), Implausible::kNo) << "one, seven periods late";
    EXPECT_EQ(joint.step({kWay * (k + 8)}, counted), counted == 1 ? Implausible::kJump : Implausible::kNo);
  }
}

TEST(Plausibility, WhatIsNoNumberOrBeyondTheStopsIsOutOfRange) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInf = std::numeric_limits<double>::infinity();
  for (const auto& [x, f] : {std::pair{kNan, 0.0},
                             {kInf, 0.0},
                             {-kInf, 0.0},
                             {0.0, kNan},
                             {0.0, kInf},
                             {0.0, -kInf},
                             {0.53, 0.0},
                             {-0.53, 0.0},
                             {1e300, 0.0}}) {
    Plausibility fresh(kJoint), running(kJoint);
    EXPECT_EQ(fresh.step({x, f}), Implausible::kRange);
    for (int k = 0; k < 100; ++k) running.step({0});
    EXPECT_EQ(running.step({x, f}), Implausible::kRange);
    EXPECT_EQ(running.step({0.3}), Implausible::kNo) << "judged anew";
  }
  Plausibility joint(kJoint);
  EXPECT_EQ(joint.step({0.52}), Implausible::kNo);
  joint.reset();
  EXPECT_EQ(joint.step({-0.52}), Implausible::kNo) << "attached elsewhere";
}

double between(std::mt19937_64& random, double low, double high) {
  return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
}

// A rotor under torques that change at random, seen through an encoder.
class Rotor {
 public:
  Rotor(std::mt19937_64& random, double J) : random_(random), J_(J) {
    const int bits = 8 + static_cast<int>(random() % 17);
    q_ = 2 * std::numbers::pi / std::exp2(bits);
    velocity_.reset(J1(0));
  }
  template <class Reaction>
  void move(const Reaction& reaction) {
    for (int sub = 0; sub < 20; ++sub) {
      const double in_stop = std::max(x - 0.349, 0.0) + std::min(x + 0.349, 0.0);
      const double stop = in_stop != 0 ? 3000 * in_stop + 3.5 * v : 0;
      v += kDt / 20 * (tau - reaction(x, v) - stop) / J_;
      x += kDt / 20 * v;
    }
  }
  Plausibility::Reading read(int ticks = 1) {
    const double seen = q_ * std::floor(x / q_ + 0.5);
    const J1 speed = ticks > 1 ? velocity_.across(J1(seen), ticks) : velocity_.step(J1(seen));
    return {seen, rtob_.step(J1(tau), J1(seen), speed)[0], tau};
  }
  double count() const { return std::max(q_, 1e-4); }

  double x = 0, v = 0, tau = 0;

 private:
  std::mt19937_64& random_;
  double J_, q_;
  Derivative<1> velocity_{Cutoff::rad_s(500), kDt};
  Rtob<1> rtob_{AxisModel{.viscous = 0}, Cutoff::rad_s(200), kDt};
};

// Pulled both ways or thrown at a wall, up to the stiffness that was promised, by a host that misses up to 100 ticks
// and over a line that repeats readings.
TEST(Plausibility, IsQuietAboutWhateverAnAxisDoes) {
  std::mt19937_64 random(1);
  int alarms = 0;
  for (int run = 0; run < 10'000; ++run) {
    const double K = std::pow(10, between(random, -1, 4)), B = 2 * between(random, 0, 1) * std::sqrt(K * kJ);
    const double wall = between(random, -0.2, 0.3);
    const bool two_sided = run % 2 == 0;
    Rotor rotor(random, kJ);
    rotor.x = std::clamp(wall + between(random, -kTop, two_sided ? kTop : 0) / std::max(K, 20.0), -0.349, 0.349);
    Plausibility joint({.resolution = rotor.count(),
                        .top_acceleration = 4 * kTop / kJ,
                        .hand_stiffness = std::max(30.0, 2 * K),
                        .inertia = 2 * kJ,
                        .stiffness = std::max(100.0, 2 * K),
                        .damping = std::max(0.3, 2 * B)});
    int ticks = 0, missed = 0;
    for (int k = 0; k < 200; ++k) {
      if (random() % 20 == 0) rotor.tau = between(random, -kTop, kTop);
      rotor.move([&](double x, double v) {
        const double f = two_sided || x > wall ? K * (x - wall) + B * v : 0;
        return two_sided ? f : std::max(f, 0.0);
      });
      ++ticks;
      if (missed-- > 0) continue;
      alarms += joint.step(rotor.read(ticks), random() % 10 != 0, ticks) != Implausible::kNo;
      ticks = 0;
      missed = random() % 50 == 0 ? static_cast<int>(random() % 100) : 0;
    }
  }
  EXPECT_EQ(alarms, 0);
}

// What stops the axis in mid-motion: hands of up to four times the stiffness that is held for the stiffest, with any
// damping, axes of 0.77 to twice the inertia that is believed, and motors that brake as fast as they can.
TEST(Plausibility, IsQuietAboutWhateverStopsAnAxisAndFindsTheEncoderThatDoesNot) {
  std::mt19937_64 random(2);
  int alarms = 0, frozen = 0, found = 0, late = 0;
  for (int run = 0; run < 20'000; ++run) {
    const double K = std::pow(10, between(random, -1, std::log10(120))), wall = between(random, -0.25, 0.25);
    const double B = 2 * between(random, 0, 1.5) * std::sqrt(K * kJ);
    Rotor rotor(random, kJ * between(random, 1 / 1.3, 2));
    rotor.x = wall - between(random, 0, 0.1), rotor.v = between(random, -1, 6);
    Plausibility joint({.resolution = rotor.count(),
                        .top_acceleration = 4 * kTop / kJ,
                        .inertia = 4 * kJ,
                        .stiffness = std::max(100.0, 2 * K),
                        .damping = std::max(0.3, 2 * B)});
    const int freezes = run % 4 == 0 ? 20 + static_cast<int>(random() % 150) : 1000;
    Plausibility::Reading now;
    double speed = 0, want = 0;
    for (int k = 0; k < 200; ++k) {
      if (random() % 40 == 0) want = between(random, -kTop, kTop);
      rotor.tau += std::clamp(want - rotor.tau, -0.5, 0.5);
      rotor.move([&](double x, double v) { return x > wall ? std::max(0.0, K * (x - wall) + B * v) : 0; });
      const Plausibility::Reading next = rotor.read();
      if (k < freezes) now = next;
      if (k == freezes) speed = std::abs(rotor.v);
      const bool alarm = joint.step(now) != Implausible::kNo;
      alarms += alarm && k < freezes;
      const bool counts = speed > 0.8 && std::abs(now.x) < 0.3 && rotor.count() < 4e-4;
      if (k < freezes || !counts) continue;
      frozen += k == freezes;
      found += alarm;
      late += alarm && k > freezes + 4;
      if (alarm) break;
    }
  }
  std::printf("%d encoders froze at more than 0.8 rad/s, %d found, %d of them later than 4 ms\n", frozen, found, late);
  EXPECT_EQ(alarms, 0);
  EXPECT_GE(found - late, 0.9 * frozen) << "the others were just being stopped";
}

}  // namespace
}  // namespace farhand
