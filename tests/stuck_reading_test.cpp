// A reading that stands: a frozen encoder is known by what the motion before it must have become, a turn is not taken
// for one.
#include "common/observer/stuck_reading.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/observer/dob.hpp"
#include "common/signal/derivative.hpp"
#include "tests/support/uniform.hpp"

namespace farhand {
namespace {

using J1 = Joints<1>;
constexpr double kDt = 1e-3, kJ = 4e-3;
const Cutoff kG_v = Cutoff::rad_s(500), kG_dis = Cutoff::rad_s(200);

// An axis of inertia J against a spring, read by an encoder, with the observers of a direct drive.
struct Axis {
  double count, J, K;
  StuckReading<1> stuck{count, 30 / kJ, kG_v, kG_dis, kDt};
  Derivative<1> derivative{kG_v, kDt};
  Dob<1> dob{kJ, kG_dis, kDt};
  double x = 0, v = 0, torque = 0;
  double frozen_at = 0;
  bool frozen = false;

  void tick(double next_torque) {
    for (int i = 0; i < 20; ++i) {
      v += kDt / 20 * (torque - K * x - 0.02 * v) / J;
      x += kDt / 20 * v;
    }
    const J1 read(frozen ? frozen_at : count * std::floor(x / count));
    if (!frozen) frozen_at = read[0];
    stuck.step(read, derivative.value(), (torque - dob.value()) / kJ);
    derivative.step(read);
    dob.step(J1(torque), derivative.value());
    torque = next_torque;
  }
};

constexpr double kCoarse = 2 * std::numbers::pi / 4096, kFine = 2 * std::numbers::pi / 20000;

TEST(StuckReading, OfAFrozenEncoderIsKnownWhileItsAxisMoves) {
  for (const double count : {kCoarse, kFine}) {
    for (const double v : {1.2, 2.0, 3.0, 4.0}) {
      Axis axis{.count = count, .J = kJ, .K = 0};
      axis.v = v;
      for (int k = 0; k < 40; ++k) axis.tick(0.02 * axis.v);
      axis.frozen = true;
      int ticks = 0;
      // The observer would drive on what seems to stop.
      while (!axis.stuck.stuck(true) && ticks < 8) axis.tick(0.02 * axis.v + axis.dob.value()[0]), ++ticks;
      EXPECT_LE(ticks, count == kCoarse && v < 2 ? 5 : 2) << count << ' ' << v;
      EXPECT_NEAR(axis.stuck.v()[0], axis.v, 0.35 * axis.v) << count << ' ' << v;
    }
  }
}

// Torques that come within 20 ms, hands from none to the stiffest, an inertia that is not the nominal one.
TEST(StuckReading, IsNeitherATurnNorASlowMotionNorAStartNorAnAxisAtRest) {
  for (std::uint64_t seed = 0; seed < 400; ++seed) {
    std::mt19937_64 bits(seed);
    Axis axis{.count = seed % 2 == 0 ? kCoarse : kFine,
              .J = kJ * uniform(bits, 0.7, 1.5),
              .K = uniform(bits, 0, 1) < 0.2 ? 0.0 : log_uniform(bits, 0.3, 20)};
    double torque = 0, until = 0, given = 0;
    for (int k = 0; k < 3000; ++k) {
      if (k >= until) {
        torque = uniform(bits, 0, 1) < 0.2 ? 0.0 : uniform(bits, -1, 1) * log_uniform(bits, 0.02, 1.5);
        until = k + log_uniform(bits, 10, 600);
      }
      // A drive that damps, so that speeds stay what a session has; it does not push on a hand at its end.
      given += 0.05 * (torque - given);
      axis.tick(std::clamp(given - 0.08 * axis.derivative.value()[0], -3.0, 3.0));
      ASSERT_FALSE(axis.stuck.stuck(false)) << seed << " at " << k << ": " << axis.v << " rad/s";
    }
  }
}

TEST(StuckReading, IsBelievedAfterEightTicksAndNeverDoubtedBeforeAWall) {
  StuckReading<1> free(kFine, 30 / kJ, kG_v, kG_dis, kDt), before_a_wall(kFine, 2e3 / kJ, kG_v, kG_dis, kDt);
  for (StuckReading<1>* one : {&free, &before_a_wall}) one->step(J1(0.0), J1(0.0), J1(0.0));
  int stuck = 0;
  for (int k = 0; k < 40; ++k) {
    free.step(J1(0.0), J1(4.0), J1(0.0));
    before_a_wall.step(J1(0.0), J1(4.0), J1(0.0));
    stuck += free.stuck(false) ? 1 : 0;
    EXPECT_FALSE(before_a_wall.stuck(true));
  }
  EXPECT_EQ(stuck, 8);
}

// Where the axis moved fast enough to be told from rest, and not for longer than an encoder may stand.
TEST(StuckReading, TellsWhichWayItMovedWhileItMayYetBeStuck) {
  for (const double v : {-3.0, -1.0, 0.1, 1.0, 3.0}) {
    Axis axis{.count = kCoarse, .J = kJ, .K = 0};
    axis.v = v;
    for (int k = 0; k < 60; ++k) axis.tick(0.02 * axis.v);
    axis.frozen = true;
    int way = 0, ticks = 0;
    for (int k = 0; k < 20; ++k) {
      axis.tick(0.02 * axis.v);
      if (axis.stuck.moved()[0] != 0.0) way = static_cast<int>(axis.stuck.moved()[0]), ++ticks;
    }
    EXPECT_EQ(way, std::fabs(v) < 0.5 ? 0 : v > 0 ? 1 : -1) << v;
    EXPECT_LE(ticks, 9) << v;
    EXPECT_EQ(axis.stuck.moved()[0], 0.0) << v;
  }
}

}  // namespace
}  // namespace farhand
