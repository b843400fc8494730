// Where guards are crossed: contacts within one step, several in order, grazing, infinitely many, inputs that jump, and
// the defined ends of an integration that cannot go on.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <random>

#include "common/integrate/dormand_prince.hpp"
#include "common/integrate/integrator.hpp"
#include "common/integrate/rk4.hpp"
#include "common/integrate/rosenbrock.hpp"
#include "common/integrate/sdirk2.hpp"
#include "common/integrate/semi_implicit_euler.hpp"
#include "tests/support/alloc_counter.hpp"
#include "tests/support/toy_plants.hpp"

namespace farhand {
namespace {

using namespace toy;

static_assert(Plant<Ceiling> && Plant<Ball> && Plant<Block> && Plant<CutOff> && Plant<LuGre>);

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

// To t in one step (for the adaptive pair: as it likes).
template <class Scheme, class P>
Integrator<Scheme, P> run(const P& plant, const typename P::State& x, double t, double h) {
  Integrator<Scheme, P> integrator({.max_step = h, .rtol = 1e-12, .atol = 1e-14});
  integrator.start(plant, 0.0, x);
  integrator.advance(plant, t);
  return integrator;
}

template <class Scheme>
class Events : public testing::Test {};
using Schemes = testing::Types<SemiImplicitEuler, Rk4, Sdirk2, Rosenbrock, DormandPrince>;
TYPED_TEST_SUITE(Events, Schemes);

// The four methods that follow a parabola exactly, so that what remains is the location of the event.
template <class Scheme>
constexpr bool kExactOnParabolas = !std::is_same_v<Scheme, SemiImplicitEuler>;

TYPED_TEST(Events, AContactThatBeginsAndEndsWithinAStepIsFound) {
  const Ceiling soft{.at = {0.1, 9.0}, .k = {100.0, 0.0}};
  const double v = std::sqrt(2.0 * 9.81 * 0.101), flight = 2.0 * v / 9.81;  // 1 mm into it, without it
  // One step of semi-implicit Euler would not even reach the ceiling.
  const auto one = run<TypeParam>(soft, {0.0, v}, flight, kExactOnParabolas<TypeParam> ? flight : flight / 500);
  EXPECT_EQ(one.counters().events, 2u);
  EXPECT_EQ(one.mode(), 0u);
  const auto fine = run<DormandPrince>(soft, {0.0, v}, flight, 1e-4);
  EXPECT_EQ(fine.counters().events, 2u);
  if (!kExactOnParabolas<TypeParam>) return;
  // The contact is a single step, of which a method of order 2 gets half of the push.
  const double push = std::fabs(fine.state()[1] + v), share = TypeParam::kOrder > 2 ? 0.05 : 0.6;
  EXPECT_GT(push, 1e-3);
  EXPECT_NEAR(one.state()[1], fine.state()[1], share * push);
}

TYPED_TEST(Events, TwoContactsWithinAStepAreTakenInOrderOfTime) {
  // The layer with the higher index is met first.
  const Ceiling layers{.at = {0.1001, 0.1}, .k = {3e3, 1e3}, .b = 4.0, .acceleration = 0.0};
  const auto one = run<TypeParam>(layers, {0.099, 1.0}, 2e-3, 2e-3);
  EXPECT_EQ(one.counters().events, 2u);
  EXPECT_EQ(one.mode(), 3u);
  if (!TypeParam::kEmbedded) {
    EXPECT_EQ(one.counters().steps, 3u);
  }
  const auto fine = run<DormandPrince>(layers, {0.099, 1.0}, 2e-3, 1e-5);
  const double stop = 1.0 - fine.state()[1];  // what the layers took of the speed: 0.7 % at least
  EXPECT_GT(stop, 7e-3);
  EXPECT_NEAR(one.state()[1], fine.state()[1], stop * (TypeParam::kOrder == 1 ? 0.5 : 0.05));
}

TYPED_TEST(Events, GrazingChangesNothing) {
  for (int i = 1; i <= 40; ++i) {
    const double height = 0.01 * i, v = std::sqrt(2.0 * 9.81 * height), end = 2.0 * v / 9.81;
    const Ceiling hard{.at = {height, 9.0}, .k = {1e6, 0.0}, .b = 400.0};
    const double even = 2.0 * std::ceil(end / 3e-3);
    for (const double steps : {even, even + 1.0}) {  // even: the touch lies on the end of a step, odd: in its middle
      const auto done = run<TypeParam>(hard, {0.0, v}, end, end / steps);
      EXPECT_EQ(done.status(), IntegratorStatus::kOk);
      EXPECT_LE(done.counters().events, 2u);
      EXPECT_EQ(done.mode(), 0u);
      if (!kExactOnParabolas<TypeParam>) continue;
      EXPECT_NEAR(done.state()[0], 0.0, 1e-8) << height << " " << steps;
      EXPECT_NEAR(done.state()[1], -v, 1e-7) << height << " " << steps;
    }
  }
}

TYPED_TEST(Events, ABallThatBouncesEverLowerEndsInADefinedWay) {
  const Ball ball;
  const double first = std::sqrt(2.0 / 9.81), all = 3.0 * first;  // sum of the flights of a ball dropped from 1 m
  Integrator<TypeParam, Ball> integrator({.max_step = 1e-3, .rtol = 1e-12, .atol = 1e-14, .max_events = 200});
  integrator.start(ball, 0.0, {1.0, 0.0});
  integrator.advance(ball, 2.3 * first);  // after the second bounce: from 2 first, at a quarter of the first speed
  EXPECT_EQ(integrator.status(), IntegratorStatus::kOk);
  EXPECT_EQ(integrator.counters().events, 2u);
  const double v = 0.25 * 9.81 * first, since = 0.3 * first,
               close = kExactOnParabolas<TypeParam> ? 1e-11 : 3.0 * 9.81e-3;
  EXPECT_NEAR(integrator.state()[0], v * since - 0.5 * 9.81 * since * since, close);
  EXPECT_NEAR(integrator.state()[1], v - 9.81 * since, close);
  const double tick = 0.01, fall = 9.81 * tick;  // what is gained where the rest of a tick is free fall
  double t = all - 0.1;
  integrator.advance(ball, t);
  for (int i = 0; i < 100; ++i) {
    integrator.advance(ball, t += tick);
    EXPECT_EQ(integrator.time(), t);
    if (t < all + tick) continue;
    EXPECT_EQ(integrator.status(), IntegratorStatus::kChattering);
    EXPECT_NEAR(integrator.state()[1], 0.0, 2.0 * fall);
    EXPECT_NEAR(integrator.state()[0], 0.0, 2.0 * fall * tick);
  }
}

TYPED_TEST(Events, ModesThatContradictEachOtherEndAsChattering) {
  const Block never_sticks{.sticks = false};
  Integrator<TypeParam, Block> integrator({.max_step = 0.01, .max_events = 50});
  integrator.start(never_sticks, 0.0, {0.0, 0.1});
  integrator.advance(never_sticks, 0.05);
  EXPECT_EQ(integrator.status(), IntegratorStatus::kOk);
  integrator.advance(never_sticks, 0.15);
  EXPECT_EQ(integrator.status(), IntegratorStatus::kChattering);
  EXPECT_EQ(integrator.time(), 0.15);
  EXPECT_NEAR(integrator.state()[1], 0.0, 0.06);
}

TYPED_TEST(Events, AnInputThatJumpsFreesAndStopsABlock) {
  Block block;
  Integrator<TypeParam, Block> integrator({.max_step = 0.01, .rtol = 1e-12, .atol = 1e-14});
  integrator.start(block, 0.0, {});
  block.hold(0.9);
  integrator.advance(block, 1.0);
  EXPECT_EQ(integrator.state(), (Block::State{}));
  block.hold(-3.0);
  integrator.advance(block, 1.5);  // a = -2
  block.hold(0.0);
  integrator.advance(block, 4.0);  // from v = -1 to rest within 1 s
  EXPECT_EQ(integrator.mode(), Block::kStick);
  EXPECT_EQ(integrator.state()[1], 0.0);
  EXPECT_NEAR(integrator.state()[0], -0.25 - 0.5, kExactOnParabolas<TypeParam> ? 1e-11 : 0.01);
  EXPECT_EQ(integrator.counters().events, 2u);
}

TYPED_TEST(Events, ABreakOfTheInputDoesNotLieWithinAStep) {
  const CutOff plant{0.7371};
  double error[2];
  for (int i = 0; i < 2; ++i) {
    const auto done = run<TypeParam>(plant, {}, 2.0, i == 0 ? 0.02 : 0.01);
    const auto exact = plant.exact_after(2.0);
    error[i] = std::hypot(done.state()[0] - exact[0], done.state()[1] - exact[1]);
    EXPECT_EQ(done.time(), 2.0);
  }
  if (TypeParam::kEmbedded) {
    EXPECT_LT(error[0], 1e-10);
  } else {
    EXPECT_NEAR(std::log2(error[0] / error[1]), TypeParam::kOrder, 0.2);
  }
}

TYPED_TEST(Events, WhatIsNoNumberIsLatchedAndTheLastGoodStateStays) {
  Block block{.friction = 0.0};
  Integrator<TypeParam, Block> integrator({.max_step = 0.01});
  for (const double bad : {kNan, kInf, -kInf}) {
    integrator.start(block, 0.0, {bad, 0.0});
    EXPECT_EQ(integrator.status(), IntegratorStatus::kDiverged);
    integrator.advance(block, 1.0);
    EXPECT_EQ(integrator.state(), (Block::State{}));
    EXPECT_EQ(integrator.time(), 1.0);

    block.hold(1.0);
    integrator.start(block, 0.0, {});
    integrator.advance(block, 1.0);
    EXPECT_EQ(integrator.status(), IntegratorStatus::kOk);
    const auto good = integrator.state();
    block.hold(bad);
    integrator.advance(block, 2.0);
    EXPECT_EQ(integrator.status(), IntegratorStatus::kDiverged);
    EXPECT_EQ(integrator.state(), good);
    EXPECT_EQ(integrator.at(1.5), good);
    block.hold(1.0);
    integrator.advance(block, 3.0);  // stays so, whatever follows
    EXPECT_EQ(integrator.status(), IntegratorStatus::kDiverged);
    EXPECT_EQ(integrator.state(), good);
    EXPECT_EQ(integrator.time(), 3.0);
  }
  block.hold(1.0);
  integrator.start(block, 0.0, {});
  integrator.advance(block, kNan);
  EXPECT_EQ(integrator.time(), 0.0);
  integrator.advance(block, kInf);
  EXPECT_EQ(integrator.status(), IntegratorStatus::kDiverged);
  EXPECT_EQ(integrator.time(), 0.0);
}

TYPED_TEST(Events, AdvancingDoesNotTouchTheHeap) {
  if (kCounterIsBlind) GTEST_SKIP();
  const Bouncer plant{1e4, 40.0};
  Integrator<TypeParam, Bouncer> integrator({.max_step = 1e-3});
  integrator.start(plant, 0.0, {0.2, 0.0});
  const TouchCounter counter;
  integrator.advance(plant, 0.5);
  const Touched since = counter.since();
  EXPECT_EQ(since.heap, 0u);
  EXPECT_EQ(since.locks, 0u);
  EXPECT_GE(integrator.counters().events, 4u);
}

// Two layers anywhere, of any stiffness and damping, any throw: what one method finds the others find.
TEST(EventsOfAnyKind, AreTheSameForEveryMethod) {
  std::mt19937_64 random(7);
  const auto uniform = [&random](double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
  };
  std::uint64_t events = 0;
  double worst[3] = {};
  for (int i = 0; i < 300; ++i) {
    const double height = uniform(0.01, 0.1), k = std::pow(10.0, uniform(1.0, 5.0)), omega = std::sqrt(k);
    const Ceiling plant{.at = {height, height + uniform(-0.3, 0.3) / omega},
                        .k = {k, k * uniform(0.1, 1.0)},
                        .b = omega * uniform(0.0, 0.5),
                        .acceleration = uniform(-15.0, 15.0)};
    const Ceiling::State x{0.0, uniform(0.5, 2.5)};
    const double t = 0.2, h = 0.02 / omega;
    const auto exact = run<DormandPrince>(plant, x, t, 1e-2);
    const auto rk4 = run<Rk4>(plant, x, t, h);
    const auto sdirk = run<Sdirk2>(plant, x, t, h);
    const auto rosenbrock = run<Rosenbrock>(plant, x, t, h);
    events += exact.counters().events;
    const double scale = std::fmax(1.0, std::fabs(exact.state()[1]));
    worst[0] = std::fmax(worst[0], std::fabs(rk4.state()[1] - exact.state()[1]) / scale);
    worst[1] = std::fmax(worst[1], std::fabs(sdirk.state()[1] - exact.state()[1]) / scale);
    worst[2] = std::fmax(worst[2], std::fabs(rosenbrock.state()[1] - exact.state()[1]) / scale);
    EXPECT_EQ(rk4.status(), IntegratorStatus::kOk);
  }
  std::printf("%d events; velocity off by %.1e RK4, %.1e SDIRK2, %.1e Rosenbrock at most\n", int(events), worst[0],
              worst[1], worst[2]);
  EXPECT_GT(events, 600u);
  EXPECT_LT(worst[0], 1e-6);  // (omega h)^4 = 1.6e-7, a few contacts after one another
  EXPECT_LT(worst[1], 1e-3);  // (omega h)^2 = 4e-4
  EXPECT_LT(worst[2], 2e-5);  // (omega h)^3 = 8e-6
}

// At 0.5 ms, whatever the wall: what the method cannot resolve it damps.
TEST(Sdirk2, StaysRightOnWallsOfAnyStiffnessAtHalfAMillisecond) {
  for (const double k : {1e3, 1e4, 1e6, 1e8}) {
    const double J = 4e-3, damping = 2.0 * std::sqrt(k * J);  // critical
    const Ceiling wall{.at = {0.1, 9.0}, .k = {k / J, 0.0}, .b = damping / J, .acceleration = 0.5 / J};
    const auto done = run<Sdirk2>(wall, {0.09, 0.3}, 0.3, 0.5e-3);
    EXPECT_EQ(done.status(), IntegratorStatus::kOk);
    EXPECT_NEAR(done.state()[0], 0.1 + 0.5 / k, 1e-9 + 1e-12 * k) << k;
    EXPECT_NEAR(done.state()[1], 0.0, 1e-7) << k;
    std::printf("wall %g: %d events, x - at - F/k = %.1e\n", k, int(done.counters().events),
                done.state()[0] - 0.1 - 0.5 / k);
  }
}

TEST(Sdirk2, FollowsABristleOfAnyStiffnessAtHalfAMillisecond) {
  for (const double s0 : {1e2, 1e4, 1e6}) {
    const LuGre plant{.s0 = s0, .s1 = 2.0 * std::sqrt(s0 * 4e-3)};
    const auto coarse = run<Sdirk2>(plant, {}, 1.0, 0.5e-3);
    const auto exact = run<Rosenbrock>(plant, {}, 1.0, 2e-5);
    EXPECT_EQ(coarse.status(), IntegratorStatus::kOk) << s0;
    std::printf("bristle %g: x %.8f, exact %.8f; Newton failed %d times\n", s0, coarse.state()[0], exact.state()[0],
                int(coarse.counters().rejected));
    EXPECT_NEAR(coarse.state()[0], exact.state()[0], 5e-4);
  }
}

}  // namespace
}  // namespace farhand
