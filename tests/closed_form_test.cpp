// The propagator without step error against formulas derived by hand, against itself in long double and in other steps,
// and against Runge-Kutta at tiny ones.
#include "common/integrate/closed_form.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <random>
#include <string>

#include "tests/support/alloc_counter.hpp"
#include "tests/support/driven_toy.hpp"
#include "tests/support/oscillator.hpp"
#include "tests/support/uniform.hpp"

namespace farhand {
namespace {

using Exact = ClosedForm<ToyPlant, double>;
using Reference = ClosedForm<ToyPlant, Real>;
constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

TEST(ClosedForm, IsTheOscillator) {
  std::mt19937_64 bits(2);
  double worst = 0;
  for (const double ratio : {0.0, 0.1, 0.7, 0.999, 1.001, 2.0}) {
    for (const double stiffness : {1e-3, 1.0, 3e3, 1e6, 1e8}) {
      ToyPlant plant{.J = 0.004, .viscous = 0, .k = stiffness, .contacts = {}, .motion = {}};
      plant.viscous = 2 * ratio * std::sqrt(stiffness * plant.J);
      const double x0 = uniform(bits, -1, 1), v0 = uniform(bits, -1, 1) * std::sqrt(stiffness / plant.J);
      Exact exact;
      exact.start(plant, 0, {x0, v0});
      for (int k = 1; k <= 2000; ++k) exact.advance(plant, k * 1e-3);
      const Real omega = std::sqrt(static_cast<Real>(stiffness) / 0.004);
      const auto Phi = Oscillator{static_cast<Real>(stiffness) / static_cast<Real>(plant.J),
                                  static_cast<Real>(plant.viscous) / static_cast<Real>(plant.J) / 2}
                           .at(2);
      const double size = std::hypot(x0, v0 / static_cast<double>(omega));
      const double error =
          std::hypot(static_cast<double>(exact.state()[0] - (Phi[0][0] * x0 + Phi[0][1] * v0)),
                     static_cast<double>((exact.state()[1] - (Phi[1][0] * x0 + Phi[1][1] * v0)) / omega));
      // 2000 roundings of the state at random, and time known to an ulp of 2 s.
      const double allowed = size * kEpsilon * (500 + 2 * static_cast<double>(omega));
      EXPECT_LE(error, allowed) << "ratio " << ratio << " stiffness " << stiffness;
      worst = std::max(worst, error / allowed);
      EXPECT_EQ(exact.counters().steps, exact.counters().steps);
    }
  }
  std::printf("worst error: %.3f of what is allowed\n", worst);
}

TEST(ClosedForm, FollowsMinimumJerkAndSineAsRungeKuttaDoesInTinySteps) {
  const ToyPlant plant = driven();
  Exact exact;
  exact.start(plant, 0, {0, 0});
  for (int k = 1; k <= 2200; ++k) exact.advance(plant, k * 1e-3);
  std::array<double, 2> x{};
  x = runge_kutta(plant, 0, 0, 0.3, x, 3000);
  x = runge_kutta(plant, 0, 0.3, 1.1, x, 8000);
  x = runge_kutta(plant, 0, 1.1, 1.9, x, 8000);
  x = runge_kutta(plant, 0, 1.9, 2.2, x, 3000);
  EXPECT_NEAR(exact.state()[0], x[0], 1e-13);
  EXPECT_NEAR(exact.state()[1], x[1], 1e-12);
}

TEST(ClosedForm, DoesNotDependOnTheTicks) {
  const ToyPlant plant = driven();
  const auto run = [&plant](auto propagator, double tick) {
    propagator.start(plant, 0, {0, 0});
    const int ticks = static_cast<int>(std::lround(2.4 / tick));
    for (int k = 1; k <= ticks; ++k) propagator.advance(plant, k * 2.4 / ticks);
    return propagator.state();
  };
  const auto truth = run(Reference(), 1e-3);
  for (const double tick : {0.125e-3, 0.5e-3, 1e-3, 7e-3, 20e-3, 2.4}) {
    const auto x = run(Exact(), tick);
    const auto y = run(Reference(), tick);
    EXPECT_NEAR(x[0], static_cast<double>(truth[0]), 4e-15) << tick;
    EXPECT_NEAR(x[1], static_cast<double>(truth[1]), 4e-14) << tick;
    EXPECT_NEAR(static_cast<double>(y[0] - truth[0]), 0, 8e-18) << tick;
  }
}

TEST(ClosedForm, TakesUnevenTicksAndTimesFarFromZero) {
  std::mt19937_64 bits(3);
  ToyPlant plant{.J = 0.004, .viscous = 0.002, .k = 5, .contacts = {}, .motion = {}};
  const double begin = 86400;  // an ulp of it is 1.5e-11 s
  Exact uneven, even;
  uneven.start(plant, begin, {0.1, 0});
  even.start(plant, begin, {0.1, 0});
  double t = begin;
  while (t < begin + 10) uneven.advance(plant, t = std::min(begin + 10, t + uniform(bits, 0, 3e-3)));
  for (int k = 1; k <= 10000; ++k) even.advance(plant, begin + k * 1e-3);
  EXPECT_EQ(even.time(), uneven.time());
  EXPECT_NEAR(even.state()[0], uneven.state()[0], 1e-14);
  EXPECT_NEAR(even.state()[1], uneven.state()[1], 4e-13);
}

struct Curved : ToyPlant {
  const char* not_affine() const noexcept { return "its friction is of LuGre's kind"; }
};

TEST(ClosedForm, RefusesWhatIsNotAffineWithTheReason) {
  ClosedForm<Curved> exact;
  try {
    exact.start(Curved{}, 0, {0, 0});
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("LuGre"), std::string::npos) << error.what();
  }
}

TEST(ClosedForm, TouchesNoHeapAfterItsConstruction) {
  if (kCounterIsBlind) GTEST_SKIP() << "a sanitizer owns malloc";
  ToyPlant plant = driven();
  plant.contacts = {{1e6, 0.4, 0.1, 1}, {3000, 3.4, -0.349, -1}, {3000, 3.4, 0.349, 1}};
  Exact exact;
  const TouchCounter counter;
  exact.start(plant, 0, {0, 0});
  double sum = 0;
  for (int i = 1; i <= 2500; ++i) {
    plant.hold(0.3 * std::sin(i * 0.05));
    exact.advance(plant, i * 1e-3);
    sum += exact.at((i - 0.5) * 1e-3)[0];
  }
  EXPECT_EQ(counter.since(), Touched{});
  EXPECT_GT(exact.counters().events, 2u);
  EXPECT_TRUE(std::isfinite(sum));
}

TEST(ClosedForm, StandsStillAtTheLastGoodStateWhenANumberIsNone) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInfinity = std::numeric_limits<double>::infinity();
  for (const double bad : {kNan, kInfinity, -kInfinity, 1e308}) {
    ToyPlant plant = driven();
    plant.contacts = {{1e4, 0.4, 0.1, 1}};
    Exact exact;
    exact.start(plant, 0, {0.01, 0.02});
    for (int i = 1; i <= 10; ++i) exact.advance(plant, i * 1e-3);
    const auto good = exact.state();
    plant.hold(bad);
    for (int i = 11; i <= 20; ++i) exact.advance(plant, i * 1e-3);
    EXPECT_EQ(exact.status(), IntegratorStatus::kDiverged);
    EXPECT_EQ(exact.state(), good);
    plant.hold(0);
    exact.advance(plant, 0.1);
    EXPECT_EQ(exact.status(), IntegratorStatus::kDiverged);
    EXPECT_EQ(exact.at(0.05), good);
    exact.start(plant, 0, {0, 0});
    EXPECT_EQ(exact.status(), IntegratorStatus::kOk);

    exact.start(plant, 0, {bad, 0});
    EXPECT_EQ(exact.status(), IntegratorStatus::kDiverged);
    exact.start(plant, 0, {0, 0});
    exact.advance(plant, bad == 1e308 ? kInfinity : bad);
    EXPECT_TRUE(std::isfinite(exact.state()[0]) && std::isfinite(exact.state()[1]));
  }
}

TEST(ClosedForm, EndsInADefinedWayWhateverThePlantIs) {
  std::mt19937_64 bits(5);
  for (int i = 0; i < 400; ++i) {
    ToyPlant plant{.J = log_uniform(bits, 1e-12, 1e6), .viscous = 0, .contacts = {}, .motion = movements()};
    plant.viscous = bits() % 4 == 0 ? 0 : log_uniform(bits, 1e-9, 1e3);
    plant.k = bits() % 2 == 0 ? 0 : log_uniform(bits, 1e-6, 1e8);
    plant.arm = bits() % 2 == 0 ? 0 : log_uniform(bits, 1e-3, 1e5);
    for (int c = 0; c < 3; ++c) {
      const double side = bits() % 2 == 0 ? 1 : -1;
      plant.contacts.push_back({log_uniform(bits, 1, 1e12), bits() % 3 == 0 ? 0 : log_uniform(bits, 1e-6, 1e4),
                                side * uniform(bits, 0, 0.1), side});
    }
    Exact exact({.max_events = 200});
    exact.start(plant, 0, {uniform(bits, -0.2, 0.2), uniform(bits, -3, 3)});
    for (int k = 1; k <= 20; ++k) {
      plant.hold(uniform(bits, -3, 3));
      exact.advance(plant, k * 5e-3);
      ASSERT_TRUE(std::isfinite(exact.state()[0]) && std::isfinite(exact.state()[1]));
    }
    ASSERT_TRUE(exact.status() == IntegratorStatus::kDiverged || exact.time() == 20 * 5e-3);
  }
}

TEST(ClosedForm, CallsTooManyEventsChattering) {
  ToyPlant plant{.J = 1e-6, .viscous = 0, .contacts = {{1e6, 0, 0, 1}, {1e6, 0, -1e-6, -1}}, .motion = {}};
  Exact exact({.max_events = 50});
  exact.start(plant, 0, {-0.5e-6, 1});
  exact.advance(plant, 1e-3);
  EXPECT_EQ(exact.status(), IntegratorStatus::kChattering);
  EXPECT_EQ(exact.time(), 1e-3);
  EXPECT_TRUE(std::isfinite(exact.state()[0]));
  EXPECT_EQ(exact.counters().events, 50u);
}

}  // namespace
}  // namespace farhand
