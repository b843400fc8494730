// Observers against closed forms, in both directions of motion.
#include <gtest/gtest.h>

#include <cmath>

#include "common/observer/rtob.hpp"
#include "common/station/limits.hpp"

namespace farhand {
namespace {

using J1 = Joints<1>;
constexpr double kJ = 4e-3;

class BothDirections : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Observer, BothDirections, testing::Values(1.0, -1.0));

TEST_P(BothDirections, DobFollowsAStepOnALockedRotor) {
  const double sign = GetParam();
  Dob<1> dob(kJ, Cutoff::rad_s(200), 1e-3);
  double tau_dis = 0.0;
  for (int k = 0; k < 5; ++k) tau_dis = dob.step(J1(sign * 0.5), J1(0.0))[0];
  EXPECT_NEAR(tau_dis, sign * 0.29906, 1e-5);
  EXPECT_NEAR(tau_dis, sign * 0.5 * (1.0 - std::pow(1.2, -5)), 1e-15);
}

// A rotor that is only held by its observer drifts away under a load tau with v = -tau (1 + g dt)/(J g): the exact
// discrete balance of zero-order-held torque and backward Euler.
TEST_P(BothDirections, DobHoldsAFreeRotorAtTheDerivedDrift) {
  const double load = GetParam() * 0.1;
  for (const auto& [dt, expected] : {std::pair{1e-3, -0.1500}, {1e-4, -0.1275}}) {
    Dob<1> dob(kJ, Cutoff::rad_s(200), dt);
    double v = 0.0;
    J1 tau = J1::Zero();
    for (double t = 0.0; t < 2.0; t += dt) {
      v += dt * (tau[0] - load) / kJ;  // exact: the torque is constant within a tick
      tau = dob.step(tau, J1(v));      // a_ref = 0, so the torque is the estimate
    }
    EXPECT_NEAR(v, GetParam() * expected, std::abs(expected) * 1e-3) << dt;
    EXPECT_NEAR(v, -load * (1.0 + 200 * dt) / (kJ * 200), 1e-9) << dt;
  }
}

TEST(Dob, SteadyAccelerationIsUnbiased) {
  for (const double a : {3.0, -3.0}) {
    for (const double g : {100.0, 200.0, 500.0, 1000.0}) {
      Dob<1> dob(kJ, Cutoff::rad_s(g), 1e-3);
      for (int k = 1; k < 5000; ++k) dob.step(J1(kJ * a), J1(a * 1e-3 * k));
      EXPECT_NEAR(dob.value()[0], 0.0, 1e-9 * kJ * std::abs(a)) << g;
    }
  }
}

// The torque that is not applied must not be estimated: with the applied torque fed back, |f| stays below the limit and
// follows a release without delay other than its own filter. Fed with the wish it would wind up by the part that was
// cut.
TEST_P(BothDirections, DobSaturationLeavesNoRecoveryTime) {
  const double sign = GetParam(), dt = 1e-3, limit = 0.6;
  Rtob<1> rtob(AxisModel{.viscous = 0.0}, Cutoff::rad_s(200), dt);
  TorqueGate<1> gate({.torque = limit, .torque_rate = 1e9}, dt);
  for (int k = 0; k < 3000; ++k) {  // a wish of 40 N m against a locked rotor
    gate.pass(J1(sign * 40.0), J1(0.0));
    const double f = rtob.step(gate.applied(), J1(0.0), J1(0.0))[0];
    ASSERT_LE(std::abs(f), limit + 1e-12);
  }
  EXPECT_NEAR(rtob.value()[0], sign * limit, 1e-9);
  for (int k = 0; k < 50; ++k) rtob.step(gate.pass(J1(0.0), J1(0.0)), J1(0.0), J1(0.0));
  EXPECT_NEAR(rtob.value()[0], sign * limit * std::pow(1.2, -50), 1e-12);
}

TEST(Dob, ResetStartsInTheSteadyState) {
  Dob<2> dob(kJ, Cutoff::rad_s(200), 1e-3);
  const Joints<2> tau(0.4, -0.2), v(1.0, -2.0);
  dob.reset(tau, v);
  EXPECT_TRUE(dob.step(tau, v).isApprox(tau, 1e-12));
}

TEST(Rtob, SeesOnlyTheTorqueThatTheModelDoesNotKnow) {
  const AxisModel model{.viscous = 0.05, .coulomb = 0.03, .gravity = 0.3, .gravity_angle = 0.2};
  for (const double v : {0.7, -0.7}) {
    for (const double f : {0.0, 0.25, -0.25}) {
      Rtob<1> rtob(model, Cutoff::rad_s(200), 1e-3);
      const double x = 0.1;
      const double load = -0.3 * std::sin(x + 0.2) + 0.05 * v + 0.03 * std::tanh(v / 0.02);
      for (int k = 0; k < 200; ++k) rtob.step(J1(load + f), J1(x), J1(v));
      EXPECT_NEAR(rtob.value()[0], f, 1e-12);
    }
  }
}

TEST(AxisModel, FrictionIsNotABareSign) {
  const AxisModel model{.viscous = 0.0, .coulomb = 0.05};
  EXPECT_EQ(model.known_load<1>(J1(0.0), J1(0.0))[0], 0.0);
  EXPECT_LT(std::abs(model.known_load<1>(J1(0.0), J1(1e-3))[0]), 0.05 * 0.06);
  EXPECT_NEAR(model.known_load<1>(J1(0.0), J1(0.2))[0], 0.05, 1e-8);
  EXPECT_NEAR(model.known_load<1>(J1(0.0), J1(-0.2))[0], -0.05, 1e-8);
}

}  // namespace
}  // namespace farhand
