// What comes in is stored or lost: d(stored) = supplied - dissipated, through contacts, stick and slip, bristles and
// springs that end. The adaptive pair integrates both, so that little but the physics is tested.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "common/integrate/dormand_prince.hpp"
#include "common/integrate/integrator.hpp"
#include "common/plant/axis_plant.hpp"
#include "common/plant/series_elastic_plant.hpp"
#include "netem/lab/metered.hpp"

namespace farhand {
namespace {

constexpr Bristle::Params kLuGre{
    .F_c = 0.05, .F_s = 0.08, .v_s = 0.1, .sigma_0 = 60, .sigma_1 = 0.01, .sigma_2 = 0.003};
constexpr Wall::Params kWall{.stiffness = 1e4, .damping = 1.26, .at = 0.1};

double torque(double t) { return std::sin(9 * t); }
double push(double t) { return 0.1 * std::sin(7 * t); }
double velocity(double t) { return 3 * std::sin(4 * t); }

// Runs input(t), held over ticks of 1 ms, and balances the energy over each tick and over all.
template <class P, class Input>
void balance(const char* name, const P& made, Input input, double seconds) {
  Metered<P> plant(made);
  IntegratorSettings settings;
  settings.max_step = 1e-3, settings.rtol = 1e-13, settings.atol = 1e-15;
  Integrator<DormandPrince, Metered<P>> integrator(settings);
  integrator.start(plant, 0, plant.start());
  const double before = plant.plant().stored_energy(0, made.start());
  double least_loss = 1, lost = 0, turnover = 0, stored = before, decided = 0;
  const int ticks = static_cast<int>(seconds * 1e3 + 0.5);
  for (int k = 0; k < ticks; ++k) {
    const double put_in = plant.plant().stored_energy(k * 1e-3, plant.own(integrator.state())) - stored;
    EXPECT_NEAR(put_in, 0, 1e-14);  // nothing but a decision changes what is stored at an instant
    plant.hold(input(k * 1e-3));
    integrator.advance(plant, (k + 1) * 1e-3);
    ASSERT_EQ(integrator.status(), IntegratorStatus::kOk);
    least_loss = std::fmin(least_loss, integrator.state()[plant.kDissipated] - lost);
    lost = integrator.state()[plant.kDissipated];
    const double now = plant.plant().stored_energy((k + 1) * 1e-3, plant.own(integrator.state()));
    turnover += std::fabs(now - stored);
    stored = now;
    if constexpr (requires { plant.decide(0.0, integrator.state()); }) {
      if (!std::isfinite(made.next_decision())) continue;
      plant.decide((k + 1) * 1e-3, integrator.state());
      stored = plant.plant().stored_energy((k + 1) * 1e-3, plant.own(integrator.state()));
      decided += stored - now;
    }
  }
  const double supplied = integrator.state()[plant.kSupplied];
  const double gap = supplied + decided - lost - (stored - before);
  std::printf("energy, %s: supplied %.6f J, lost %.6f J, stored %.6f J, gap %.1e J, %llu events\n", name, supplied,
              lost, stored - before, gap, static_cast<unsigned long long>(integrator.counters().events));
  EXPECT_GT(lost, 1e-4);
  EXPECT_GE(least_loss, -1e-13);
  EXPECT_LT(std::fabs(gap), 1e-9 * (lost + turnover));
}

template <Friction kFriction>
MasterPlantWith<kFriction> master(const MotorAxis::Params& motor) {
  MasterPlant::Params p{.motor = motor};
  p.load.intended = {Movement::ramp(0.6, 0.3), Movement::sine(0.2, 2, 0.4), Movement::ramp(-0.6, 0.3)};
  return MasterPlantWith<kFriction>(p);
}

TEST(Energy, BalancesInSmoothMotion) {
  MasterPlant::Params swinging{.motor = {.gravity = 0.2, .gravity_angle = 0.3}};
  swinging.load.intended = {Movement::ramp(0.2, 1), Movement::ramp(-0.2, 1)};
  balance("weight", MasterPlant(swinging), push, 3);
  balance("hand", DirectSlavePlant({.load = {.hand = Hand::Params{.stiffness = 5}}}), push, 3);
  balance("series elastic", SeriesElasticPlant({.environment = {.hand = Hand::Params{}}}), velocity, 2);
}

// A spastic catch only takes energy; a patient who moves by himself also gives.
TEST(Energy, BalancesWithAHandThatActs) {
  const Hand::Params spastic{.stiffness = 3, .spastic = 0.3};
  balance("spastic", DirectSlavePlant({.load = {.hand = spastic}}), push, 3);
  balance("spastic, orthosis", SeriesElasticPlant({.environment = {.hand = spastic}}), velocity, 2);
  const Hand::Params moving{.stiffness = 3, .rest_amplitude = 0.15, .rest_frequency = 0.7};
  balance("rest angle moves", DirectSlavePlant({.load = {.hand = moving}}), push, 3);
  balance("rest angle moves, orthosis", SeriesElasticPlant({.environment = {.hand = moving}}), velocity, 2);
  const Hand::Params relaxing{.stiffness = 5, .rest_amplitude = 0.15, .relaxed = 1, .relax_time = 0.5};
  balance("relaxing", DirectSlavePlant({.load = {.hand = relaxing}}), push, 3);
  balance("relaxing, orthosis", SeriesElasticPlant({.environment = {.hand = relaxing}}), velocity, 2);
  const Hand::Params trembling{.stiffness = 3, .tremor = 0.1};
  balance("trembling", DirectSlavePlant({.load = {.hand = trembling}}), push, 3);
  balance("trembling, orthosis", SeriesElasticPlant({.environment = {.hand = trembling}}), velocity, 2);
}

TEST(Energy, BalancesWithATherapistWhoGivesWay) {
  MasterPlant::Params p;
  p.load.K_h = 10, p.load.B_h = 0.15;
  p.load.intended = {Movement::ramp(0.6, 0.3), Movement::sine(0.2, 2, 1)};
  p.load.reaction = VoluntaryReaction::Params{.above = 0.5, .after = 0.05};
  balance("gives way", MasterPlant(p), torque, 2);
}

TEST(Energy, BalancesThroughImpactsAndStops) {
  balance("arm against stops", master<Friction::kNone>({}), torque, 2);
  balance("wall and stops", DirectSlavePlant({.load = {.hand = Hand::Params{}, .wall = kWall}}), torque, 2);
}

TEST(Energy, BalancesThroughStickAndSlip) {
  balance("stick-slip, arm", master<Friction::kCoulomb>({.coulomb = 0.3}), push, 2);
  balance("stick-slip, wall",
          DirectSlavePlantWith<Friction::kCoulomb>({.motor = {.coulomb = 0.06}, .load = {.wall = kWall}}), push, 2);
}

TEST(Energy, BalancesWithBristles) {
  balance("LuGre, arm", master<Friction::kBristle>({.bristle = kLuGre}), push, 1);
  balance("LuGre, wall",
          DirectSlavePlantWith<Friction::kBristle>({.motor = {.bristle = kLuGre}, .load = {.wall = kWall}}), torque, 1);
  SeriesElasticParams p{.environment = {.hand = Hand::Params{}, .wall = kWall}};
  p.actuator.tendon = Bristle::dahl(0.05, 20);
  balance("Dahl in the tendons", SeriesElasticPlantWith<Friction::kBristle>(p), velocity, 1);
}

TEST(Energy, BalancesWithASpringThatEnds) {
  SeriesElasticParams p{.environment = {.hand = Hand::Params{}, .wall = kWall}};
  p.actuator.spring_range = 0.05;
  balance("spring with ends", SeriesElasticPlant(p), velocity, 2);
}

}  // namespace
}  // namespace farhand
