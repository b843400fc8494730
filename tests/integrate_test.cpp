// The integrators on smooth plants and across contacts: orders of convergence, stability limits, dense output,
// counters.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdio>
#include <numbers>

#include "common/integrate/dormand_prince.hpp"
#include "common/integrate/integrator.hpp"
#include "common/integrate/rk4.hpp"
#include "common/integrate/rosenbrock.hpp"
#include "common/integrate/sdirk2.hpp"
#include "common/integrate/semi_implicit_euler.hpp"
#include "common/integrate/stiffness.hpp"
#include "tests/support/toy_plants.hpp"

namespace farhand {
namespace {

using namespace toy;

static_assert(Plant<Linear<2>> && Plant<Driven> && Plant<Nonlinear> && Plant<Bouncer> && Plant<StickSlip>);

template <class State>
double distance(const State& a, const State& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i) worst = std::fmax(worst, std::fabs(a[i] - b[i]));
  return worst;
}

// Least squares slope of log(error) over log(h), h halved `halvings` times.
template <class Error>
double fitted_order(double h, int halvings, Error error) {
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (int i = 0; i <= halvings; ++i, h /= 2.0) {
    const double x = std::log(h), y = std::log(error(h));
    n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y;
  }
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

template <class Scheme, class P>
Integrator<Scheme, P> run(const P& plant, const typename P::State& x, double t, double h) {
  Integrator<Scheme, P> integrator({.max_step = h});
  integrator.start(plant, 0.0, x);
  integrator.advance(plant, t);
  EXPECT_EQ(integrator.status(), IntegratorStatus::kOk) << Scheme::kName << " " << h;
  EXPECT_EQ(integrator.time(), t);
  return integrator;
}

template <class Scheme>
class FixedStep : public testing::Test {};
using FixedSteps = testing::Types<SemiImplicitEuler, Rk4, Sdirk2, Rosenbrock>;
TYPED_TEST_SUITE(FixedStep, FixedSteps);

TYPED_TEST(FixedStep, HasItsOrderWhereTimeDrivesThePlant) {
  const double order = fitted_order(
      0.02, 4, [](double h) { return distance(run<TypeParam>(Driven{}, {}, 2.0, h).state(), Driven::exact(2.0)); });
  std::printf("%-20s driven oscillator: order %.3f\n", TypeParam::kName, order);
  EXPECT_NEAR(order, TypeParam::kOrder, 0.2);
}

TYPED_TEST(FixedStep, HasItsOrderWhereTheJacobianDependsOnStateAndTime) {
  const double order = fitted_order(0.05, 4, [](double h) {
    return distance(run<TypeParam>(Nonlinear{}, {1.0}, 2.0, h).state(), Nonlinear::exact(2.0));
  });
  std::printf("%-20s y' = -y^2 cos t: order %.3f\n", TypeParam::kName, order);
  EXPECT_NEAR(order, TypeParam::kOrder, 0.2);
}

TYPED_TEST(FixedStep, KeepsItsOrderAcrossContacts) {
  for (const double k : {1e3, 1e4, 1e6}) {
    const Bouncer plant{k, 0.4 * std::sqrt(k)};
    const double t = 0.5, coarse = 0.05 / std::sqrt(k);
    std::uint64_t events = 0;
    const double order = fitted_order(coarse, 4, [&](double h) {
      const auto end = run<TypeParam>(plant, {0.2, 0.0}, t, h);
      events = end.counters().events;
      return distance(end.state(), plant.exact(0.2, t));
    });
    std::printf("%-20s bouncing on k = %g: order %.3f, %d events\n", TypeParam::kName, k, order, int(events));
    EXPECT_NEAR(order, TypeParam::kOrder, 0.2) << k;
    EXPECT_GE(events, k < 1e4 ? 2u : 4u);
  }
}

TYPED_TEST(FixedStep, KeepsItsOrderThroughStickAndSlip) {
  const StickSlip plant;
  const double order = fitted_order(0.1, 4, [&](double h) {
    return distance(run<TypeParam>(plant, {0.0, 1.0}, 20.0, h).state(), plant.exact(20.0));
  });
  std::printf("%-20s stick and slip: order %.3f\n", TypeParam::kName, order);
  EXPECT_NEAR(order, TypeParam::kOrder, 0.2);
}

TYPED_TEST(FixedStep, HasADenseOutputOfItsOrder) {
  const double order = fitted_order(0.05, 3, [](double h) {
    Integrator<TypeParam, Driven> integrator({.max_step = h});
    const Driven plant;
    integrator.start(plant, 0.0, {});
    double worst = 0;
    for (double t = h; t < 2.0; t += h) {
      integrator.advance(plant, t);
      for (const double theta : {0.25, 0.5, 0.75})
        worst = std::fmax(worst, distance(integrator.at(t - theta * h), Driven::exact(t - theta * h)));
    }
    return worst;
  });
  std::printf("%-20s dense output: order %.3f\n", TypeParam::kName, order);
  EXPECT_NEAR(order, TypeParam::kOrder, 0.2);
}

// ---------------------------------------------------------------- stability

Linear<2> mode_of(std::complex<double> s) { return Linear<2>{{{{s.real(), -s.imag()}, {s.imag(), s.real()}}}}; }
Linear<2> oscillator(double omega) { return Linear<2>{{{{0.0, 1.0}, {-omega * omega, 0.0}}}}; }

// Spectral radius of one step of length 1.
template <class Scheme>
double growth(const Linear<2>& plant) {
  Work<Linear<2>> work;
  std::array<double, 2> a, b;
  EXPECT_TRUE(Scheme::step(plant, 0, 0.0, {1.0, 0.0}, 1.0, a, work));
  work.moved();
  EXPECT_TRUE(Scheme::step(plant, 0, 0.0, {0.0, 1.0}, 1.0, b, work));
  return std::abs(fastest_eigenvalue(std::array{a[0], b[0], a[1], b[1]}, 2));
}

template <class Scheme, class PlantOfRate>
double stability_limit(PlantOfRate plant) {
  double low = 0.1, high = 10.0;
  for (int i = 0; i < 50; ++i) {
    const double middle = 0.5 * (low + high);
    (growth<Scheme>(plant(middle)) <= 1.0 + 1e-9 ? low : high) = middle;
  }
  return low;
}

TEST(Stability, LimitsOfTheExplicitMethodsAgreeWithTheory) {
  const double real = stability_limit<Rk4>([](double rate) { return mode_of(-rate); });
  const double imaginary = stability_limit<Rk4>([](double rate) { return mode_of({0.0, rate}); });
  const double euler = stability_limit<SemiImplicitEuler>(oscillator);
  std::printf("limits: RK4 %.4f real, %.4f imaginary; semi-implicit Euler %.4f\n", real, imaginary, euler);
  EXPECT_NEAR(real, 2.7853, 0.01 * 2.7853);
  EXPECT_NEAR(imaginary, 2.0 * std::numbers::sqrt2, 0.01 * 2.83);
  EXPECT_NEAR(euler, 2.0, 0.01 * 2.0);
}

TEST(Stability, Rk4DampsEveryStableModeInsideItsStableRadius) {
  double worst = 0;
  for (int angle = 90; angle <= 180; ++angle)
    for (int r = 1; r <= 100; ++r)
      worst = std::fmax(
          worst, growth<Rk4>(mode_of(std::polar(kRk4StableRadius * r / 100.0, angle * std::numbers::pi / 180.0))));
  EXPECT_LE(worst, 1.0 + 1e-12);
}

template <class Scheme>
class Implicit : public testing::Test {};
using ImplicitSchemes = testing::Types<Sdirk2, Rosenbrock>;
TYPED_TEST_SUITE(Implicit, ImplicitSchemes);

TYPED_TEST(Implicit, IsStableInTheWholeLeftHalfPlane) {
  double worst = 0;
  for (int angle = 90; angle <= 180; ++angle)
    for (double radius = 1e-3; radius < 1e9; radius *= 1.5)
      worst = std::fmax(worst, growth<TypeParam>(mode_of(std::polar(radius, angle * std::numbers::pi / 180.0))));
  EXPECT_LE(worst, 1.0 + 1e-12);
}

TYPED_TEST(Implicit, IsRidOfAFastModeInOneLargeStep) {
  for (const double rate : {1e6, 1e8, 1e10}) {
    EXPECT_LE(growth<TypeParam>(mode_of(-rate)), 6.0 / rate);
    EXPECT_LE(growth<TypeParam>(mode_of({0.0, rate})), 6.0 / rate);
  }
}

// ---------------------------------------------------------------- the adaptive pair

template <class P>
Integrator<DormandPrince, P> run_adaptive(const P& plant, const typename P::State& x, double t, double rtol) {
  Integrator<DormandPrince, P> integrator({.max_step = 1.0, .rtol = rtol, .atol = rtol});
  integrator.start(plant, 0.0, x);
  integrator.advance(plant, t);
  EXPECT_EQ(integrator.status(), IntegratorStatus::kOk);
  return integrator;
}

TEST(DormandPrince, HasItsOrderAndADenseOutputOfOrderFour) {
  const auto one_step = [](double h, double theta) {
    const Driven plant;
    Work<Driven> work;
    Driven::State y;
    DormandPrince::step(plant, 0, 1.0, Driven::exact(1.0), h, y, work);
    return distance(DormandPrince::dense<Driven>(Driven::exact(1.0), h, y, work).at(theta),
                    Driven::exact(1.0 + theta * h));
  };
  const double order = fitted_order(0.4, 4, [&](double h) { return one_step(h, 1.0); }) - 1.0;
  const double dense = fitted_order(0.2, 4, [&](double h) { return one_step(h, 0.4); }) - 1.0;
  std::printf("Dormand-Prince: order %.3f, dense output %.3f\n", order, dense);
  EXPECT_NEAR(order, 5.0, 0.2);
  EXPECT_NEAR(dense, 4.0, 0.2);
}

TEST(DormandPrince, KeepsItsErrorNearTheTolerance) {
  const Bouncer bouncer{1e6, 400.0};
  const StickSlip belt;
  for (double rtol = 1e-5; rtol > 1e-12; rtol *= 0.1) {
    const double driven = distance(run_adaptive(Driven{}, {}, 20.0, rtol).state(), Driven::exact(20.0));
    const double bounced = distance(run_adaptive(bouncer, {0.2, 0.0}, 0.5, rtol).state(), bouncer.exact(0.2, 0.5));
    const double slipped = distance(run_adaptive(belt, {0.0, 1.0}, 20.0, rtol).state(), belt.exact(20.0));
    std::printf("rtol %.0e: error %.1e driven, %.1e bouncing, %.1e stick and slip\n", rtol, driven, bounced, slipped);
    EXPECT_LT(driven, 100.0 * rtol);
    EXPECT_LT(bounced, 100.0 * rtol);
    EXPECT_LT(slipped, 100.0 * rtol);
  }
}

TEST(DormandPrince, RemembersItsStepAcrossAdvances) {
  const Driven plant;
  Integrator<DormandPrince, Driven> integrator({.max_step = 1.0, .rtol = 1e-9, .atol = 1e-9});
  integrator.start(plant, 0.0, {});
  for (int tick = 1; tick <= 10; ++tick) integrator.advance(plant, 0.001 * tick);
  const auto settled = integrator.counters();
  for (int tick = 11; tick <= 1010; ++tick) integrator.advance(plant, 0.001 * tick);
  EXPECT_EQ(integrator.counters().steps - settled.steps, 1000u);
  EXPECT_EQ(integrator.counters().rejected, settled.rejected);
  EXPECT_EQ(integrator.counters().derivatives - settled.derivatives, 7000u);
}

TEST(DormandPrince, NeverDiverges) {
  for (const double rate : {1e2, 1e4, 1e6}) {
    for (const double angle : {0.5, 0.75, 1.0}) {
      const auto plant = mode_of(std::polar(rate, angle * std::numbers::pi));
      Integrator<DormandPrince, Linear<2>> integrator({.max_step = 1e-2, .rtol = 1e-6, .atol = 1e-6});
      integrator.start(plant, 0.0, {1.0, 0.0});
      integrator.advance(plant, 1e3 / rate);
      EXPECT_EQ(integrator.status(), IntegratorStatus::kOk);
      EXPECT_EQ(integrator.counters().unmet, 0u);
      EXPECT_LE(std::hypot(integrator.state()[0], integrator.state()[1]), 1.001) << rate << " " << angle;
    }
  }
}

TEST(DormandPrince, CountsTheStepsWhoseErrorItCouldNotMeet) {
  const auto plant = mode_of({0.0, 1e8});  // the shortest step is a millionth of the longest
  Integrator<DormandPrince, Linear<2>> integrator({.max_step = 1e-2, .rtol = 1e-6, .atol = 1e-6});
  integrator.start(plant, 0.0, {1.0, 0.0});
  integrator.advance(plant, 1.00055e-6);
  EXPECT_GE(integrator.counters().unmet, 90u);
}

// ---------------------------------------------------------------- counters, ends, choice

TEST(Counters, CountWhatIsDone) {
  const Driven plant;
  const auto rk4 = run<Rk4>(plant, {}, 1.0, 0.1).counters();
  EXPECT_EQ(rk4.steps, 10u);
  EXPECT_EQ(rk4.derivatives, 40u);
  EXPECT_EQ(rk4.jacobians + rk4.events + rk4.rejected, 0u);
  const auto euler = run<SemiImplicitEuler>(plant, {}, 1.0, 0.1).counters();
  EXPECT_EQ(euler.derivatives, 20u);
  const auto sdirk = run<Sdirk2>(plant, {}, 1.0, 0.1).counters();
  EXPECT_EQ(sdirk.derivatives, 40u);  // of each stage one to solve with, one to see that it is solved
  EXPECT_EQ(sdirk.jacobians, 10u);
  const auto rosenbrock = run<Rosenbrock>(plant, {}, 1.0, 0.1).counters();
  EXPECT_EQ(rosenbrock.derivatives, 30u);
  EXPECT_EQ(rosenbrock.jacobians, 10u);
}

TYPED_TEST(FixedStep, EndsExactlyAtTheEndWithTheFewestStepsAllowed) {
  struct Case {
    double t0, t1, step;
    std::uint64_t steps;
  };
  for (const Case c : {Case{0, 1e-3, 50e-6, 20}, Case{3600, 3600.001, 50e-6, 20}, Case{1e6, 1e6 + 1e-3, 50e-6, 20},
                       Case{0, 1e-3, 1.0, 1}, Case{0, 1e-3, 0.9e-3, 2}, Case{2, 2, 50e-6, 0}, Case{2, 1, 50e-6, 0}}) {
    const Linear<2> plant{{{{0.0, 1.0}, {0.0, 0.0}}}};
    Integrator<TypeParam, Linear<2>> integrator({.max_step = c.step});
    integrator.start(plant, c.t0, {0.0, 1.0});
    integrator.advance(plant, c.t1);
    EXPECT_EQ(integrator.counters().steps, c.steps) << c.t0;
    EXPECT_EQ(integrator.time(), c.steps > 0 ? c.t1 : c.t0);
    EXPECT_NEAR(integrator.state()[0], c.steps > 0 ? c.t1 - c.t0 : 0.0, 1e-15);
  }
}

TEST(IntegratorSettings, ThatCannotWorkAreRefused) {
  for (const IntegratorSettings bad :
       {IntegratorSettings{.max_step = 0}, IntegratorSettings{.max_step = -1}, IntegratorSettings{.max_step = NAN},
        IntegratorSettings{.rtol = 0}, IntegratorSettings{.rtol = NAN}, IntegratorSettings{.atol = -1},
        IntegratorSettings{.max_events = 0}})
    EXPECT_THROW((Integrator<Rk4, Driven>(bad)), std::invalid_argument);
}

TEST(Stiffness, IsTheEigenvalueOfLargestModulus) {
  // (s + 1e6) (s^2 + 2 s + 1e4) (s + 3), coupled by an ill-scaled similarity.
  const double scale = 1e5;
  const Linear<4> plant{{{{-1e6, scale, 0.0, 0.0},
                          {0.0, 0.0, 1.0 / scale, 0.0},
                          {0.0, -1e4 * scale, -2.0, scale},
                          {0.0, 0.0, 0.0, -3.0}}}};
  EXPECT_NEAR(std::abs(fastest_eigenvalue(plant, 0, 0.0, {}) + 1e6), 0.0, 1e-6);
  for (const double k : {1.0, 1e6, 1e12, 1e18}) {
    const Linear<2> wall{{{{0.0, 1.0}, {-k, -0.2 * std::sqrt(k)}}}};
    const auto s = fastest_eigenvalue(wall, 0, 0.0, {});
    EXPECT_NEAR(std::abs(s), std::sqrt(k), 1e-12 * std::sqrt(k));
    EXPECT_NEAR(s.real(), -0.1 * std::sqrt(k), 1e-12 * std::sqrt(k));
  }
  EXPECT_TRUE(std::isinf(std::abs(fastest_eigenvalue(Linear<1>{{{{NAN}}}}, 0, 0.0, {}))));
}

TEST(Stiffness, ChoosesTheMethodBehindItsNumber) {
  const Bouncer plant{1e6, 400.0};
  const Situation<Bouncer> both[]{{Bouncer::kOpen, 0.0, {}}, {Bouncer::kPushing, 0.0, {}}};
  const MethodChoice fine = choose<Bouncer>(plant, 2.5e-3, both), coarse = choose<Bouncer>(plant, 2.7e-3, both);
  EXPECT_EQ(fine.method, Method::kRk4);
  EXPECT_NEAR(fine.rate_times_step, 2.5, 1e-9);
  EXPECT_EQ(coarse.method, Method::kSdirk2);
  EXPECT_EQ(coarse.mode, Bouncer::kPushing);
  EXPECT_NEAR(coarse.eigenvalue.real(), -200.0, 1e-6);
  EXPECT_EQ(name_of(coarse.method), "SDIRK2");
  struct Affine : Bouncer {
    const char* reason;
    const char* not_affine() const noexcept { return reason; }
  };
  const Situation<Affine> open[]{{}};
  EXPECT_EQ(choose<Affine>(Affine{{1e6, 400.0}, nullptr}, 1.0, open).method, Method::kClosedForm);
  EXPECT_STREQ(choose<Affine>(Affine{{1e6, 400.0}, "weight"}, 1.0, open).not_affine, "weight");
}

}  // namespace
}  // namespace farhand
