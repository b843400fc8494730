// Laws, compensations and the last gate.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "common/law/acceleration_law.hpp"
#include "common/law/cdob.hpp"
#include "common/law/four_channel_cdob_sdcv.hpp"
#include "common/law/sdcv.hpp"
#include "common/signal/delay_line.hpp"
#include "common/station/drive_law.hpp"
#include "common/station/limits.hpp"
#include "netem/lab/bare_law.hpp"
#include "netem/lab/plain_step.hpp"
#include "tests/support/dice.hpp"

namespace farhand {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

TEST(FourChannel, PullsPositionsTogetherAndForcesToZeroSum) {
  const FourChannelGains K;
  EXPECT_DOUBLE_EQ(four_channel(K, motion(0.1, 0, 0), motion(0.2, 0, 0))[0], 400 * 0.1);
  EXPECT_DOUBLE_EQ(four_channel(K, motion(0, 1, 0), motion(0, -1, 0))[0], -80);
  EXPECT_DOUBLE_EQ(four_channel(K, motion(0, 0, 0.5), motion(0, 0, -0.5))[0], 0);
  EXPECT_DOUBLE_EQ(four_channel(K, motion(0, 0, 0.5), motion(0, 0, 0.25))[0], -250 * 0.75);
}

// Common and differential mode (Daud 2011, 5.6 and 5.7) are recovered from the two references.
TEST(FourChannel, SplitsIntoCommonAndDifferentialMode) {
  const FourChannelGains K;
  const Motion<1> m = motion(0.2, 0.3, -0.4), s = motion(0.1, -0.2, 0.7);
  const double a_m = four_channel(K, m, s)[0], a_s = four_channel(K, s, m)[0];
  EXPECT_NEAR(a_m + a_s, -2 * K.K_f * (-0.4 + 0.7), 1e-12);
  EXPECT_NEAR(a_m - a_s, -2 * (K.K_p * 0.1 + K.K_d * 0.5), 1e-12);
}

TEST(Sdcv, IsThePiecewiseLinearLawOfTheModulus) {
  const Sdcv<1> sdcv(SdcvParams{}, 1e-3);
  for (const auto& [f, alpha] :
       {std::pair{0.0, 1.0}, {.35, 1.0}, {.45, .75}, {.55, .5}, {-.65, .25}, {.75, 0.0}, {-1.0, 0.0}}) {
    EXPECT_NEAR(sdcv.raw(J1(f))[0], alpha, 1e-12) << f;
    EXPECT_NEAR(sdcv.raw(J1(-f))[0], alpha, 1e-12) << -f;
  }
}

TEST(Sdcv, FadesWithItsOwnTimeConstant) {
  Sdcv<1> sdcv(SdcvParams{}, 1e-3);
  EXPECT_EQ(sdcv.value()[0], 1.0);
  for (int k = 1; k <= 400; ++k) EXPECT_NEAR(sdcv.step(J1(2.0))[0], std::pow(1.005, -k), 1e-12);
}

// The telescoped observer against the thesis's own drawing (Daud 2011, 5.10 and 5.14): network disturbance as a second
// difference, low-pass, two sums. From rest both are the same numbers, up to the rounding that the drawn form piles up.
TEST(Cdob, TelescopedFormEqualsTheDrawnOne) {
  const double dt = 1e-3;
  const FourChannelGains K;
  Cdob<1> cdob(K, Cutoff::rad_s(1000), LocalModel::kThesis, dt);
  LowPass<1> drawn(Cutoff::rad_s(1000), dt);
  DelayLine<double, 256> slave(100);
  double x_model = 0, v_model = 0, u_1 = 0, u_2 = 0, r_1 = 0, sum = 0, x_drawn = 0;
  for (int k = 0; k < 3000; ++k) {
    const double t = dt * k;
    const Motion<1> m = motion(0.25 * std::sin(3.1 * t), 0.25 * 3.1 * std::cos(3.1 * t), 0.02 * std::sin(7 * t));
    const double r = slave.step(m.x[0]), r_v = (r - r_1) / dt;
    const double u = x_model - r;
    sum += drawn.step(J1(u - 2 * u_1 + u_2))[0];
    x_drawn += sum;
    cdob.step(m, motion(r, r_v, 0));
    ASSERT_NEAR(cdob.x_cdob()[0], x_drawn, 1e-10) << k;
    const double x_p = r + cdob.x_cdob()[0], v_p = r_v + cdob.v_cdob()[0];
    v_model += dt * (K.K_p * (m.x[0] - x_p) + K.K_d * (m.v[0] - v_p) - K.K_f * m.f[0]);
    x_model += dt * v_model;
    u_2 = u_1;
    u_1 = u;
    r_1 = r;
  }
  EXPECT_GT(std::abs(x_drawn), 1e-3);
}

TEST(Cdob, StartsWithoutAStep) {
  Cdob<2> cdob(FourChannelGains{}, Cutoff::rad_s(1000), LocalModel::kThesis, 1e-3);
  Motion<2> received;
  received.x = {0.2, -0.1};
  cdob.reset(received);
  cdob.step(received, received);
  EXPECT_TRUE(cdob.x_cdob().isZero(0.0));
}

TEST(TorqueGate, NothingButFiniteSlowSmallTorqueLeaves) {
  std::mt19937_64 random(7);
  const auto uniform = [&](double a, double b) {
    return a + (b - a) * (static_cast<double>(random() >> 11) * 0x1p-53);
  };
  for (int round = 0; round < 200; ++round) {
    const GateParams p{.torque = uniform(0.1, 5), .torque_rate = uniform(1, 5000), .range_min = -0.3, .range_max = 0.4};
    TorqueGate<2> gate(p, 1e-3);
    Joints<2> last = Joints<2>::Zero();
    for (int k = 0; k < 200; ++k) {
      Joints<2> wish(uniform(-10, 10), uniform(-10, 10)), x(uniform(-0.5, 0.5), uniform(-0.5, 0.5));
      const int dice = static_cast<int>(random() % 20);
      if (dice == 0) wish[1] = kNan;
      if (dice == 1) wish[0] = kInf;
      if (dice == 2) x[0] = kNan;
      const Joints<2> tau = gate.pass(wish, x);
      ASSERT_TRUE(tau.allFinite());
      ASSERT_LE(tau.abs().maxCoeff(), p.torque);
      ASSERT_LE((tau - last).abs().maxCoeff(), p.torque_rate * 1e-3 * (1 + 1e-12));
      ASSERT_EQ((gate.active() & kLimitNotFinite) != 0, dice < 3);
      last = tau;
    }
  }
}

TEST(TorqueGate, OutwardTorqueEndsAtTheEndOfTheRange) {
  for (const double side : {1.0, -1.0}) {
    TorqueGate<1> gate({.torque = 3, .torque_rate = 1e9, .range_min = -0.3, .range_max = 0.3}, 1e-3);
    EXPECT_EQ(gate.pass(J1(side * 2.0), J1(side * 0.31))[0], 0.0);
    EXPECT_TRUE(gate.active() & kLimitRange);
    EXPECT_EQ(gate.pass(J1(-side * 2.0), J1(side * 0.31))[0], -side * 2.0);
    EXPECT_EQ(gate.active(), 0u);
    EXPECT_EQ(gate.pass(J1(side * 2.0), J1(side * 0.2))[0], side * 2.0);
    EXPECT_EQ(gate.active(), 0u);
  }
}

TEST(ReferenceGate, AWrongReferenceMovesByOneStep) {
  std::mt19937_64 random(11);
  const auto uniform = [&](double a, double b) {
    return a + (b - a) * (static_cast<double>(random() >> 11) * 0x1p-53);
  };
  const GateParams p{.torque = 2, .velocity = 1.5, .range_min = -0.3, .range_max = 0.3};
  ReferenceGate<1> gate(p, 1e-3);
  gate.reset(J1(0.05));
  double last = 0.05;
  for (int k = 0; k < 20000; ++k) {
    Motion<1> wish = motion(uniform(-5, 5), uniform(-9, 9), uniform(-9, 9));
    if (k % 17 == 0) wish.f[0] = kNan;
    const Motion<1> out = gate.pass(wish);
    ASSERT_TRUE(out.finite());
    ASSERT_LE(std::abs(out.x[0] - last), 1.5e-3 + 1e-15);
    ASSERT_LE(std::abs(out.x[0]), 0.3);
    ASSERT_LE(std::abs(out.v[0]), 1.5);
    ASSERT_LE(std::abs(out.f[0]), 2.0);
    last = out.x[0];
  }
}

TEST(Scene, ReferencesAreThoseOfTheHandWrittenStep) {
  Dice dice(4);
  Seen seen;
  for (int episode = 0; episode < kEpisodes; ++episode) {
    ControlParams p = dice.settings();
    if (episode % 2 == 0) p.drive.gate.acceleration = std::exp(dice.uniform(0.0, 9.0));
    ReferenceDrive<1> drive(p.drive);
    PlainReferenceStep<> plain(p);
    for (int k = 0; k < kTicks; ++k) {
      double in[4];
      dice.next(in);
      const auto [x, x_r, v_r, f_r] = in;
      const ReferenceDrive<1>::Sensed sensed{.x = J1(x), .f = J1(0.1), .valid = true};
      if (!sensed.finite()) continue;  // a station does not look at such readings
      if (k == 0) {
        drive.reset(sensed);
        plain.reset(x);
      }
      const Motion<1> local = drive.observe(sensed, 1);
      const auto command = drive.follow(local, motion(x_r, v_r, f_r), {}, 1);
      plain.step(x, x_r, v_r, f_r);
      ASSERT_TRUE(command.track);
      ASSERT_NEAR(local.v[0], plain.v, 1e-12);
      ASSERT_NEAR(command.reference.x[0], plain.x_ref, 1e-12);
      ASSERT_NEAR(command.reference.v[0], plain.v_ref, 1e-12);
      ASSERT_NEAR(command.reference.f[0], plain.f_ref, 1e-12);
      ASSERT_EQ(drive.active_limits(), plain.limits);
      seen.add(plain.limits);
    }
  }
  for (const LimitBit bit :
       {kLimitTorque, kLimitRate, kLimitRange, kLimitVelocity, kLimitNotFinite, kLimitAcceleration})
    EXPECT_GT(seen.of(bit), 100) << bit;
}

// Two joints of a scene are two scenes of one joint.
TEST(Scene, JointsDoNotMix) {
  Dice dice(5);
  for (int episode = 0; episode < 20; ++episode) {
    ControlParams p = dice.settings();
    p.law.sdcv.from_patient = episode % 2 == 1;
    DirectDrive<2> drive(p.drive);
    FourChannelCdobSdcv<2> both(p.law, p.drive.K, p.drive.dt_s);
    LawInputs<2> inputs;
    inputs.engaged = true;
    const auto first = make_block_law("FOUR_CHANNEL_CDOB_SDCV", p),
               second = make_block_law("FOUR_CHANNEL_CDOB_SDCV", p);
    Dice other(static_cast<std::uint64_t>(100 + episode));
    for (int k = 0; k < kTicks; ++k) {
      double a[4], b[4];
      if (dice.next(a) || other.next(b)) continue;
      inputs.received = {{a[1], b[1]}, {a[2], b[2]}, {a[3], b[3]}};
      const auto one = [&](auto& law, const double(&in)[4]) {
        law->observe(in[0]);
        return law->follow({in[1], in[2], in[3]});
      };
      inputs.local = drive.observe({.x = {a[0], b[0]}}, 1);
      const Joints<2> torque = drive.follow(inputs.local, both.step(inputs).follow, {}, 1).torque;
      ASSERT_NEAR(torque[0], one(first, a), 1e-12);
      ASSERT_NEAR(torque[1], one(second, b), 1e-12);
    }
  }
}

}  // namespace
}  // namespace farhand
