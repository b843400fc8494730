// What every plant promises to the integrators: its Jacobian and time derivative are those of its derivative, its
// affine form says the same in long double, and crossing a guard leads where the state says.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "common/plant/axis_plant.hpp"
#include "common/plant/series_elastic_plant.hpp"

namespace farhand {
namespace {

constexpr Bristle::Params kLuGre{
    .F_c = 0.05, .F_s = 0.08, .v_s = 0.1, .sigma_0 = 60, .sigma_1 = 0.01, .sigma_2 = 0.003};
constexpr Wall::Params kWall{.stiffness = 1e4, .damping = 1.26, .at = 0.1};
constexpr Hand::Params kHand{.stiffness = 5, .damping = 0.02, .rest = 0.05, .from = 0.5, .until = 2.5};
constexpr Hand::Params kActiveHand{.stiffness = 5,
                                   .damping = 0.02,
                                   .rest = 0.05,
                                   .from = 0.5,
                                   .until = 2.5,
                                   .spastic = 0.3,
                                   .spastic_above = 0.2,
                                   .rest_amplitude = 0.15,
                                   .rest_frequency = 1.7};
Hand::Params trembling() {
  Hand::Params hand = kActiveHand;
  hand.rest_amplitude = 0, hand.tremor = 0.1, hand.tremor_frequency = 6;
  return hand;
}
Hand::Params relaxing() {
  Hand::Params hand = kActiveHand;
  hand.relaxed = 1, hand.relax_time = 0.7, hand.tremor = 0.1;
  return hand;
}

template <Friction kFriction>
MotorAxis::Params motor(double gravity) {
  MotorAxis::Params p{.gravity = gravity, .gravity_angle = 0.3, .stop_min = -0.12, .stop_max = 0.12};
  if (kFriction == Friction::kCoulomb) p.coulomb = 0.04;
  if (kFriction == Friction::kBristle) p.bristle = kLuGre;
  return p;
}
template <Friction kFriction>
MasterPlantWith<kFriction> master(double gravity = 0) {
  MasterPlant::Params p{.motor = motor<kFriction>(gravity)};
  p.load.intended = {Movement::hold(0.4), Movement::ramp(0.3, 0.7), Movement::sine(0.1, 1.5, 1.1),
                     Movement::ramp(-0.2, 0.5)};
  return MasterPlantWith<kFriction>(p);
}
// Has felt too much for a while, and is drawing back.
template <Friction kFriction>
MasterPlantWith<kFriction> giving_way() {
  MasterPlant::Params p{.motor = motor<kFriction>(0)};
  p.load.intended = {Movement::hold(0.4), Movement::ramp(0.3, 0.7), Movement::sine(0.1, 1.5, 1.1)};
  p.load.reaction = VoluntaryReaction::Params{.above = 0.1, .after = 0.02};
  MasterPlantWith<kFriction> plant(p);
  for (int k = 1; k < 100; ++k) plant.decide(0.4, {-0.2, 0});
  return plant;
}
template <Friction kFriction>
DirectSlavePlantWith<kFriction> direct(double gravity = 0, const Hand::Params& hand = kHand) {
  return DirectSlavePlantWith<kFriction>({.motor = motor<kFriction>(gravity), .load = {.hand = hand, .wall = kWall}});
}
template <Friction kFriction>
SeriesElasticPlantWith<kFriction> elastic(const Hand::Params& hand = kHand) {
  SeriesElasticParams p{.environment = {.hand = hand, .wall = kWall}};
  p.actuator.spring_range = 0.15;
  p.actuator.stop_min = -0.12, p.actuator.stop_max = 0.12;
  if (kFriction == Friction::kBristle) p.actuator.tendon = kLuGre;
  return SeriesElasticPlantWith<kFriction>(p);
}

class Contract : public testing::Test {
 protected:
  double uniform(double a) { return a * (2.0 * static_cast<double>(random_() >> 11) * 0x1p-53 - 1.0); }

  template <class P>
  typename P::State state() {
    typename P::State x;
    for (double& xi : x) xi = uniform(0.5);
    x[1] *= 6;
    if (P::kStates == 4 || P::kStates == 5) x[3] *= 6;
    if (P::kStates % 2 == 1) x.back() = uniform(0.05);
    return x;
  }
  // Modes as they come, and contacts that hold where they should not, as in a step that goes too far.
  template <class P>
  Mode mode(const P& plant, double t, const typename P::State& x) {
    Mode bits = plant.mode_at(t, x);
    if (random_() % 2 == 0) bits ^= static_cast<Mode>(random_()) & (kAtStopMin | kAtStopMax);
    if (random_() % 2 == 0 && (bits & kHandPresent) != 0) bits ^= static_cast<Mode>(random_()) & kAtWall;
    if (spastic_ && (bits & kHandPresent) != 0 && random_() % 2 == 0)
      bits = (bits & ~kStretched) | (random_() % 2 == 0 ? kStretchedUp : kStretchedDown);
    if (random_() % 2 == 0) bits ^= kSlidesBack;
    if (P::kStates == 2 && P::kGuards > 2 && random_() % 8 == 0) bits |= static_cast<Mode>(random_()) & kSticking;
    return bits;
  }

  template <class P>
  void check_slopes(P plant, double input) {
    std::vector<Mode> seen;
    for (int k = 0; k < 3000; ++k) {
      plant.hold(uniform(input));
      const double t = 1.5 + uniform(1.45);
      const typename P::State x = state<P>();
      const Mode m = mode(plant, t, x);
      seen.push_back(m & ((1u << kPieceShift) - 1));
      const auto J = plant.jacobian(m, t, x);
      const auto d = plant.time_derivative(m, t, x);
      const double h = 1e-6;
      for (std::size_t j = 0; j <= P::kStates; ++j) {
        typename P::State up = x, down = x;
        if (j < P::kStates) up[j] += h, down[j] -= h;
        const double dt = j < P::kStates ? 0.0 : h;
        const auto f = plant.derivative(m, t + dt, up), g = plant.derivative(m, t - dt, down);
        const auto here = plant.derivative(m, t, x);
        for (std::size_t i = 0; i < P::kStates; ++i) {
          const double slope = (f[i] - g[i]) / (2 * h), said = j < P::kStates ? J[i][j] : d[i];
          // Rounding of a difference, and the third derivative.
          ASSERT_NEAR(said, slope, 1e-9 * std::fabs(here[i]) + 1e-7 * std::fabs(slope) + 1e-5)
              << "row " << i << " column " << j << " mode " << m;
        }
      }
    }
    std::sort(seen.begin(), seen.end());
    const auto modes = std::unique(seen.begin(), seen.end()) - seen.begin();
    std::printf("%zu states: %td modes\n", P::kStates, modes);
    EXPECT_GE(modes, 4);
  }

  template <class P>
  void check_affine(P plant, double input) {
    ASSERT_EQ(plant.not_affine(), nullptr);
    for (int k = 0; k < 3000; ++k) {
      plant.hold(uniform(input));
      const double t = 1.5 + uniform(1.45);
      const typename P::State x = state<P>();
      const Mode m = mode(plant, t, x);
      const auto f = plant.derivative(m, t, x);
      const auto g = plant.guards(m, t, x);
      const auto flow = plant.template flow<long double>(m);
      const auto forms = plant.template guard_forms<long double>(m);
      const long double r = plant.template forcing<long double>(t).at(t);
      std::array<long double, P::kStates> wide;
      std::copy(x.begin(), x.end(), wide.begin());
      for (std::size_t i = 0; i < P::kStates; ++i) {
        long double sum = flow.b[i] + flow.e[i] * r;
        for (std::size_t j = 0; j < P::kStates; ++j) sum += flow.A[i][j] * wide[j];
        ASSERT_NEAR(f[i], static_cast<double>(sum), 1e-14 * std::fabs(f[i]) + 1e-9) << "row " << i << " mode " << m;
      }
      for (std::size_t i = 0; i < P::kGuards; ++i) {
        if (forms[i].kind == AffineGuard<long double, P::kStates>::Kind::kNever) {
          ASSERT_GT(g[i], 0);
        } else {
          ASSERT_NEAR(g[i], static_cast<double>(forms[i].value(wide, r)), 1e-11) << "guard " << i << " mode " << m;
        }
      }
    }
  }

  // The mode of a state has no guard below zero; a state that is moved along until a guard falls is, once it has
  // crossed and moved on, in the mode that it was told.
  template <class P>
  void check_crossings(P plant, double input) {
    int crossed = 0;
    for (int k = 0; k < 500; ++k) {
      plant.hold(uniform(input));
      double t = 0.05 + 0.006 * k;
      typename P::State x = state<P>();
      for (std::size_t i = 0; i < P::kStates; i += 2) x[i] *= 0.26;  // not so deep that a plain step explodes
      if (P::kStates == 2 && P::kGuards > 2 && k % 4 == 0) x[1] = 0;
      Mode m = plant.mode_at(t, x);
      for (const double g : plant.guards(m, t, x)) ASSERT_GE(g, 0.0) << m;
      for (int step = 0; step < 500; ++step) {
        const auto along = [&](double h) {
          typename P::State y = x;
          for (const double part : {0.5, 1.0}) {  // midpoint rule
            const auto f = plant.derivative(m, t, y);
            for (std::size_t i = 0; i < P::kStates; ++i) y[i] = x[i] + part * h * f[i];
          }
          return y;
        };
        const auto fallen = [&](double h) {
          const auto g = plant.guards(m, t, along(h));
          for (std::size_t i = 0; i < P::kGuards; ++i)
            if (g[i] < 0) return i;
          return P::kGuards;
        };
        double h = 2e-5;
        if (plant.next_break(t) < t + h) break;
        if (fallen(h) == P::kGuards) {
          x = along(h);
          continue;
        }
        double kept = 0;
        while (h - kept > 1e-12) {
          const double half = 0.5 * (h + kept);
          (fallen(half) == P::kGuards ? kept : h) = half;
        }
        const std::size_t guard = fallen(h);
        x = along(h);
        const Mode next = plant.cross(m, guard, t, x);
        ASSERT_NE(next, m);
        if ((next & kSticking) != 0) {
          ASSERT_EQ(x[1], 0.0);
        }
        m = next;
        x = along(1e-9);
        ASSERT_EQ(plant.mode_at(t, x), m) << "guard " << guard;
        ++crossed;
      }
    }
    std::printf("%zu states, %zu guards: %d crossings\n", P::kStates, P::kGuards, crossed);
    EXPECT_GT(crossed, 50);
  }

  // A step said to keep clear of all borders meets none on its whole way.
  template <class P>
  void check_clearance(P plant, double input) {
    int clear = 0, touching = 0;
    for (int k = 0; k < 10'000; ++k) {
      plant.hold(uniform(input));
      const double t = 1.5 + uniform(1.45), h = std::pow(10.0, -3.5 + uniform(1.5));
      typename P::State from = state<P>();
      from[0] *= 0.3;
      const Mode m = mode(plant, t, from) & ~(kSlidesBack | kSticking);
      typename P::State to = from;
      bool touches = false;
      constexpr int kParts = 50;
      for (int i = 0; i < kParts; ++i) {
        const auto f = plant.derivative(m, t, to);
        typename P::State middle = to;
        for (std::size_t j = 0; j < P::kStates; ++j) middle[j] += 0.5 * h / kParts * f[j];
        const auto g = plant.derivative(m, t, middle);
        for (std::size_t j = 0; j < P::kStates; ++j) to[j] += h / kParts * g[j];
        for (const double guard : plant.guards(m, t, to)) touches = touches || !(guard > 0);
      }
      if (touches) ++touching;
      if (!plant.keeps_clear(m, from, to, h)) continue;
      ++clear;
      ASSERT_FALSE(touches) << "from " << from[0] << " at " << from[1] << " to " << to[0] << " in " << h << " s";
    }
    std::printf("%d steps keep clear, %d of the others touch\n", clear, touching);
    EXPECT_GT(clear, 1000);
    EXPECT_GT(touching, 1000);
  }

  bool spastic_ = false;

 private:
  std::mt19937_64 random_{5};
};

TEST_F(Contract, JacobianAndTimeDerivativeAreThoseOfTheDerivative) {
  check_slopes(master<Friction::kNone>(0.2), 3);
  check_slopes(master<Friction::kCoulomb>(0.2), 0.5);
  check_slopes(master<Friction::kBristle>(), 3);
  check_slopes(giving_way<Friction::kNone>(), 3);
  check_slopes(direct<Friction::kNone>(), 3);
  check_slopes(direct<Friction::kCoulomb>(), 0.5);
  check_slopes(direct<Friction::kBristle>(0.2), 3);
  check_slopes(elastic<Friction::kNone>(), 4);
  check_slopes(elastic<Friction::kBristle>(), 4);
  spastic_ = true;
  check_slopes(direct<Friction::kNone>(0, kActiveHand), 3);
  check_slopes(direct<Friction::kCoulomb>(0, kActiveHand), 0.5);
  check_slopes(elastic<Friction::kNone>(kActiveHand), 4);
  check_slopes(elastic<Friction::kBristle>(kActiveHand), 4);
  check_slopes(direct<Friction::kNone>(0, relaxing()), 3);
  check_slopes(elastic<Friction::kBristle>(relaxing()), 4);
}

TEST_F(Contract, TheAffineFormSaysTheSame) {
  static_assert(AffinePlant<MasterPlant> && AffinePlant<MasterPlantWith<Friction::kCoulomb>>);
  static_assert(AffinePlant<DirectSlavePlant> && AffinePlant<DirectSlavePlantWith<Friction::kCoulomb>>);
  static_assert(AffinePlant<SeriesElasticPlant>);
  check_affine(master<Friction::kNone>(), 3);
  check_affine(master<Friction::kCoulomb>(), 0.5);
  check_affine(giving_way<Friction::kNone>(), 3);
  check_affine(giving_way<Friction::kCoulomb>(), 0.5);
  check_affine(direct<Friction::kNone>(), 3);
  check_affine(direct<Friction::kCoulomb>(), 0.5);
  check_affine(elastic<Friction::kNone>(), 4);
  spastic_ = true;
  check_affine(direct<Friction::kNone>(0, kActiveHand), 3);
  check_affine(direct<Friction::kCoulomb>(0, kActiveHand), 0.5);
  check_affine(elastic<Friction::kNone>(kActiveHand), 4);
  check_affine(direct<Friction::kNone>(0, trembling()), 3);
  check_affine(elastic<Friction::kNone>(trembling()), 4);
}

TEST_F(Contract, WhatIsNotAffineSaysWhy) {
  static_assert(Plant<MasterPlantWith<Friction::kBristle>> && !AffinePlant<MasterPlantWith<Friction::kBristle>>);
  static_assert(Plant<SeriesElasticPlantWith<Friction::kBristle>>);
  EXPECT_STREQ(master<Friction::kNone>(0.2).not_affine(), "weight acts by the sine of the angle");
  EXPECT_STREQ(direct<Friction::kBristle>().not_affine(), "the bristle's torque is multiplied by the speed");
  EXPECT_STREQ(elastic<Friction::kBristle>().not_affine(), "the bristle's torque is multiplied by the speed");
  EXPECT_STREQ(direct<Friction::kNone>(0, relaxing()).not_affine(), "the stiffness of the hand follows the time");
  EXPECT_STREQ(elastic<Friction::kNone>(relaxing()).not_affine(), "the stiffness of the hand follows the time");
  Hand::Params both = trembling();
  both.rest_amplitude = 0.1;
  EXPECT_STREQ(elastic<Friction::kNone>(both).not_affine(), "the hand moves and trembles at a frequency each");
}

TEST_F(Contract, CrossingAGuardLeadsWhereTheStateSays) {
  check_crossings(master<Friction::kNone>(), 3);
  check_crossings(master<Friction::kCoulomb>(), 0.2);
  check_crossings(direct<Friction::kNone>(), 3);
  check_crossings(direct<Friction::kCoulomb>(), 0.2);
  check_crossings(direct<Friction::kBristle>(), 3);
  check_crossings(elastic<Friction::kNone>(), 4);
  check_crossings(elastic<Friction::kBristle>(), 4);
  check_crossings(direct<Friction::kNone>(0, kActiveHand), 3);
  check_crossings(direct<Friction::kCoulomb>(0, kActiveHand), 0.2);
  check_crossings(direct<Friction::kBristle>(0, kActiveHand), 3);
  check_crossings(elastic<Friction::kNone>(kActiveHand), 4);
}

TEST_F(Contract, AStepSaidToKeepClearTouchesNothing) {
  check_clearance(master<Friction::kNone>(0.2), 3);
  check_clearance(direct<Friction::kNone>(), 3);
  check_clearance(direct<Friction::kNone>(0, kActiveHand), 3);
}

TEST_F(Contract, AtRestOnABorderTheAccelerationDecides) {
  for (const double side : {1.0, -1.0}) {
    DirectSlavePlant::Params p{.start = side * 0.349};
    DirectSlavePlant at_stop(p);
    const Mode stop = side > 0 ? kAtStopMax : kAtStopMin;
    at_stop.hold(side * 0.1);
    EXPECT_EQ(at_stop.mode_at(0, at_stop.start()), stop);
    at_stop.hold(-side * 0.1);
    EXPECT_EQ(at_stop.mode_at(0, at_stop.start()), Mode{0});
  }
}

TEST_F(Contract, APlantIsMadeForOneFriction) {
  EXPECT_THROW(MasterPlant({.motor = motor<Friction::kCoulomb>(0)}), std::invalid_argument);
  EXPECT_THROW(DirectSlavePlantWith<Friction::kBristle>({}), std::invalid_argument);
}

// A scene names its breaks in time one after the other, and a piece is smooth beyond its ends.
TEST_F(Contract, BreaksAreTheEndsOfMovementsAndTheHandsTimes) {
  const auto m = master<Friction::kNone>();
  std::vector<double> breaks;
  for (double t = -1; std::isfinite(t = m.next_break(t));) breaks.push_back(t);
  ASSERT_EQ(breaks.size(), 5u);
  EXPECT_EQ(breaks[0], 0.0);
  EXPECT_NEAR(breaks[2], 1.1, 1e-15);
  EXPECT_NEAR(breaks[4], 2.7, 1e-15);
  const Mode before = m.mode_at(1.1 - 1e-9, {}), after = m.mode_at(1.1 + 1e-9, {});
  EXPECT_NE(before, after);
  const double a = m.derivative(before, 1.1, {})[1], b = m.derivative(after, 1.1, {})[1];
  EXPECT_NEAR(b - a, 0.06 * 0.1 * 2 * M_PI * 1.5 / 0.005, 1e-9);  // the sine takes up its velocity at once
  EXPECT_EQ(direct<Friction::kNone>().next_break(0), 0.5);
}

}  // namespace
}  // namespace farhand
