// The propagator without step error on the plants of the scenes.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "common/integrate/closed_form.hpp"
#include "common/integrate/dormand_prince.hpp"
#include "common/integrate/integrator.hpp"
#include "common/plant/axis_plant.hpp"
#include "common/plant/series_elastic_plant.hpp"

namespace farhand {
namespace {

using Real = long double;

// 3 s in ticks of 1 ms, the input from `law`, by the closed form in double; beside it, under the same inputs, in long
// double and by the adaptive pair at its tightest.
template <class P, class Law>
void compare(const char* name, const typename P::Params& params, double to_reference, double to_adaptive, Law law) {
  P plant(params);
  ClosedForm<P> exact;
  ClosedForm<P, Real> reference;
  Integrator<DormandPrince, P> adaptive({.max_step = 1e-3, .rtol = 1e-14, .atol = 1e-16});
  exact.start(plant, 0, plant.start());
  typename ClosedForm<P, Real>::State begin;
  for (std::size_t i = 0; i < P::kStates; ++i) begin[i] = static_cast<Real>(plant.start()[i]);
  reference.start(plant, 0, begin);
  adaptive.start(plant, 0, plant.start());
  double worst = 0, apart = 0;
  for (int k = 1; k <= 3000; ++k) {
    plant.hold(law(k * 1e-3, exact.state()));
    exact.advance(plant, k * 1e-3), reference.advance(plant, k * 1e-3), adaptive.advance(plant, k * 1e-3);
    worst = std::max(worst, std::fabs(static_cast<double>(exact.state()[0] - reference.state()[0])));
    apart = std::max(apart, std::fabs(exact.state()[0] - adaptive.state()[0]));
  }
  std::printf("%s: %llu events, %.2g rad from long double, %.2g rad from the adaptive pair\n", name,
              static_cast<unsigned long long>(exact.counters().events), worst, apart);
  EXPECT_EQ(exact.status(), IntegratorStatus::kOk);
  EXPECT_EQ(exact.counters().events, reference.counters().events);
  EXPECT_GE(exact.counters().events, 1u);
  EXPECT_LE(worst, to_reference);
  EXPECT_LE(apart, to_adaptive);
}

TEST(ClosedForm, AdvancesTheMasterThroughMovementsAndStops) {
  MasterPlant::Params params;
  params.load.intended = {Movement::ramp(0.3, 0.7), Movement::sine(0.1, 1.3, 1), Movement::hold(0.2),
                          Movement::ramp(-0.4, 0.5)};
  compare<MasterPlant>("master", params, 1e-14, 1e-12, [](double t, const auto&) { return 0.2 * std::sin(9 * t); });
}
TEST(ClosedForm, AdvancesASlaveAgainstAWallWithAHandIn) {
  DirectSlavePlant::Params params;
  params.load.hand = Hand::Params{.from = 0.5, .until = 2.2};
  params.load.wall = Wall::Params{.stiffness = 1e4, .damping = 4, .at = 0.1};
  compare<DirectSlavePlant>("slave", params, 1e-14, 1e-12,
                            [](double t, const auto& x) { return 5 * (0.2 * std::sin(4 * t) - x[0]) - 0.05 * x[1]; });
}
TEST(ClosedForm, AdvancesTheOrthosisWithSpringEndsAgainstAWall) {
  SeriesElasticPlant::Params params;
  params.actuator.spring_range = 0.05;
  params.environment.wall = Wall::Params{.stiffness = 1e3, .damping = 1, .at = 0.1};
  compare<SeriesElasticPlant>("orthosis", params, 1e-14, 1e-12,
                              [](double t, const auto&) { return 1.2 * std::cos(5 * t); });
}
TEST(ClosedForm, AdvancesASpasticHandWhoseRestAngleMoves) {
  const Hand::Params hand{.stiffness = 3,
                          .rest = 0.02,
                          .from = 0.5,
                          .until = 2.7,
                          .spastic = 0.3,
                          .rest_amplitude = 0.15,
                          .rest_frequency = 0.7};
  DirectSlavePlant::Params direct;
  direct.load.hand = hand;
  compare<DirectSlavePlant>("spastic", direct, 1e-14, 1e-12,
                            [](double t, const auto& x) { return 5 * (0.2 * std::sin(6 * t) - x[0]) - 0.05 * x[1]; });
  SeriesElasticPlant::Params elastic;
  elastic.environment.hand = hand;
  compare<SeriesElasticPlant>("spastic, orthosis", elastic, 1e-14, 1e-12,
                              [](double t, const auto&) { return 1.2 * std::cos(5 * t); });
}
TEST(ClosedForm, AdvancesAHandThatTrembles) {
  DirectSlavePlant::Params params;
  params.load.hand = Hand::Params{.stiffness = 3, .from = 0.5, .spastic = 0.3, .tremor = 0.1};
  compare<DirectSlavePlant>("trembling", params, 1e-14, 1e-12,
                            [](double t, const auto& x) { return 5 * (0.2 * std::sin(6 * t) - x[0]) - 0.05 * x[1]; });
}
TEST(ClosedForm, AdvancesASlaveThatSticksAndSlips) {
  using Sticky = DirectSlavePlantWith<Friction::kCoulomb>;
  Sticky::Params params;
  params.motor.coulomb = 0.05;
  params.load.wall = Wall::Params{.stiffness = 1e4, .damping = 4, .at = 0.1};
  compare<Sticky>("sticky slave", params, 1e-14, 1e-11,
                  [](double t, const auto& x) { return 3 * (0.2 * std::sin(4 * t) - x[0]) - 0.05 * x[1]; });
}

}  // namespace
}  // namespace farhand
