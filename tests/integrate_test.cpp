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

}  // namespace
}  // namespace farhand
