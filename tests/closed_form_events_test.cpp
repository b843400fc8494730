// The closed form across events: contacts that open and close, friction that sticks and slips; by hand, in long double
// and by Runge-Kutta between the instants.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <random>

#include "common/integrate/closed_form.hpp"
#include "tests/support/driven_toy.hpp"
#include "tests/support/oscillator.hpp"
#include "tests/support/uniform.hpp"

namespace farhand {
namespace {

using Exact = ClosedForm<ToyPlant, double>;
using Reference = ClosedForm<ToyPlant, Real>;
constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

// Falls by a constant force on a wall at 0 and bounces: by parabola and damped oscillation, hand over hand.
struct BounceTrain {
  Real J, k, b, force;
  Real p, v;  // penetration and its speed
  Real sigma() const { return b / (2 * J); }
  // Free flight until p = 0 from below; the time it takes.
  Real fly() {
    const Real a = force / J, root = std::sqrt(v * v - 2 * a * p), time = (root - v) / a;
    p = 0, v = root;
    return time;
  }
  void contact(Real t, Real& q, Real& w) const {  // penetration and speed a time t after the touch
    const Real rest = force / k, omega2 = k / J, d = std::sqrt(omega2 - sigma() * sigma());
    const Real e = std::exp(-sigma() * t), c = std::cos(d * t), s = std::sin(d * t);
    const Real A = -rest, B = (v + sigma() * A) / d;
    q = rest + e * (A * c + B * s);
    w = e * ((B * d - sigma() * A) * c - (A * d + sigma() * B) * s);
  }
  // Until it would pull.
  Real touch() {
    Real low = 0, high = std::numbers::pi_v<Real> / std::sqrt(k / J - sigma() * sigma()), q, w;
    low = high / 4;
    high *= 1.2L;
    for (int i = 0; i < 200; ++i) {
      const Real middle = (low + high) / 2;
      contact(middle, q, w);
      (k * q + b * w < 0 ? high : low) = middle;
    }
    contact(low, q, w);
    p = q, v = w;
    return low;
  }
};

TEST(ClosedForm, BouncesAsDerivedByHand) {
  for (const double b : {0.0, 0.02, 0.2}) {
    const double force = 0.4, k = 1e4, J = 0.004;
    ToyPlant plant{.J = J, .viscous = 0, .contacts = {{k, b, 0.1, 1}}, .motion = {}, .input = force};
    BounceTrain train{static_cast<Real>(J), static_cast<Real>(k), static_cast<Real>(b), static_cast<Real>(force), 0, 0};
    const double p0 = 0.05 - 0.1;
    train.p = static_cast<Real>(0.05) - static_cast<Real>(0.1);
    Exact exact;
    Reference reference;
    exact.start(plant, 0, {0.1 + p0, 0});
    reference.start(plant, 0, {static_cast<Real>(0.05), 0});
    Real t = 0;
    int bounces = 0;
    while (t < 0.5L && bounces < 6) t += train.fly(), t += train.touch(), ++bounces;
    // Some time into the next flight.
    const double end = static_cast<double>(t) + 1e-3;
    const Real s = static_cast<Real>(end) - t, a = static_cast<Real>(force) / static_cast<Real>(J);
    const Real x = static_cast<Real>(0.1) + train.p + train.v * s + a * s * s / 2, v = train.v + a * s;
    for (int i = 1; i * 1e-3 < end; ++i) exact.advance(plant, i * 1e-3), reference.advance(plant, i * 1e-3);
    exact.advance(plant, end), reference.advance(plant, end);
    EXPECT_EQ(exact.counters().events, static_cast<std::uint64_t>(2 * bounces));
    EXPECT_EQ(exact.mode(), 0u);
    EXPECT_NEAR(exact.state()[0], static_cast<double>(x), 1e-14) << "b " << b;
    // A rounding of the angle, 1.4e-17 rad, is one of its speed times sqrt(k / J) = 1.6e3 at each of twelve borders.
    EXPECT_NEAR(exact.state()[1], static_cast<double>(v), 1e-12) << "b " << b;
    EXPECT_NEAR(static_cast<double>(reference.state()[0] - x), 0, 1e-17) << "b " << b;
    std::printf("b = %g: %d bounces, error %.2g rad in double, %.2Lg in long double\n", b, bounces,
                exact.state()[0] - static_cast<double>(x), reference.state()[0] - x);
  }
}

TEST(ClosedForm, NeverMissesAContactWithinOneTick) {
  std::mt19937_64 bits(4);
  int touched = 0;
  for (int i = 0; i < 10000; ++i) {
    // A parabola whose top is `depth` beyond the wall, somewhere within the tick.
    const double depth = (bits() % 2 != 0 ? 1 : -1) * log_uniform(bits, 1e-13, 1e-4);
    const double top = uniform(bits, 0.05e-3, 0.95e-3), a = log_uniform(bits, 1e3, 1e6);
    const double J = 0.004, side = bits() % 2 != 0 ? 1 : -1, at = 0.1 * side;
    ToyPlant plant{.J = J, .viscous = 0, .contacts = {{log_uniform(bits, 1e2, 1e8), 0, at, side}}, .motion = {}};
    plant.hold(-side * a * J);
    const double x0 = at + side * (depth - a * top * top / 2);
    if ((x0 - at) * side >= 0) continue;  // began beyond
    Exact exact;
    exact.start(plant, 0, {x0, side * a * top});
    exact.advance(plant, 1e-3);
    ASSERT_EQ(exact.status(), IntegratorStatus::kOk);
    if (std::fabs(depth) > 1e-15) {
      const std::uint64_t least = depth > 0 ? 1 : 0;
      // Still in contact at the end, or out of it again; without contact, nothing.
      ASSERT_EQ(std::min<std::uint64_t>(exact.counters().events, 1), least)
          << "depth " << depth << " top " << top << " a " << a;
      touched += depth > 0;
    }
  }
  std::printf("%d of 10000 touched\n", touched);
}

TEST(ClosedForm, ReflectsAtAHardWallWithinOneTick) {
  // 1e8 N m/rad: in contact for 20 us.
  ToyPlant plant{.J = 0.004, .viscous = 0, .contacts = {{1e8, 0, 0.1, 1}}, .motion = {}};
  Exact exact;
  exact.start(plant, 0, {0.0995, 1});
  exact.advance(plant, 1e-3);
  EXPECT_EQ(exact.counters().events, 2u);
  const double contact = std::numbers::pi / std::sqrt(1e8 / 0.004);
  // A rounding of the angle, 1.4e-17 rad, times sqrt(k / J) = 1.6e5.
  EXPECT_NEAR(exact.state()[1], -1.0, 4e-12);
  EXPECT_NEAR(exact.state()[0], 0.1 - (1e-3 - 0.5e-3 - contact), 4e-15);
}

TEST(ClosedForm, KeepsTheEnergyOfABouncingMass) {
  for (const double k : {1e3, 1e5, 1e7}) {
    ToyPlant plant{.J = 0.004, .viscous = 0, .k = 2, .contacts = {{k, 0, 0.1, 1}, {k, 0, -0.2, -1}}, .motion = {}};
    const auto energy = [&plant, k](const Exact::State& x) {
      const double p = std::max({0.0, x[0] - 0.1, -0.2 - x[0]});
      return 0.5 * (plant.J * x[1] * x[1] + plant.k * x[0] * x[0] + k * p * p);
    };
    Exact exact;
    exact.start(plant, 0, {0, 3});
    const double begin = energy(exact.state());
    double worst = 0;
    for (int i = 1; i <= 10000; ++i) {
      exact.advance(plant, i * 1e-3);
      worst = std::max(worst, std::fabs(energy(exact.state()) / begin - 1));
    }
    EXPECT_LE(worst, 1e-13 * (1 + std::sqrt(k) * 1e-2)) << k;
    std::printf("k = %g: %llu events, energy kept to %.2g\n", k,
                static_cast<unsigned long long>(exact.counters().events), worst);
  }
}

TEST(ClosedForm, SurvivesStiffWallsOfAnyDampingAndAgreesWithLongDouble) {
  for (const double k : {1e3, 1e4, 1e6, 1e8}) {
    for (const double ratio : {0.0, 0.1, 1.0, 2.0}) {
      for (const double tick : {0.5e-3, 20e-3}) {
        ToyPlant plant = driven();
        const double b = 2 * ratio * std::sqrt(k * plant.J);
        plant.contacts = {{k, b, 0.1, 1}, {3000, 3.4, -0.349, -1}, {3000, 3.4, 0.349, 1}};
        Exact exact;
        Reference reference;
        exact.start(plant, 0, {0, 0});
        reference.start(plant, 0, {0, 0});
        double worst = 0;
        for (int i = 1; i * tick <= 1.5; ++i) {
          plant.hold(i * tick > 1.2 ? 0.5 : 0.0);
          exact.advance(plant, i * tick), reference.advance(plant, i * tick);
          worst = std::max(worst, std::fabs(static_cast<double>(exact.state()[0] - reference.state()[0])));
        }
        EXPECT_EQ(exact.status(), IntegratorStatus::kOk);
        EXPECT_EQ(exact.counters().events, reference.counters().events) << k << " " << ratio << " " << tick;
        EXPECT_GE(exact.counters().events, 1u);
        // A rounding of the angle is one of the speed times sqrt(k / J); bounces without loss hand it on and on.
        const double allowed = 4e-14 + 3e-17 * std::sqrt(k / plant.J) * (ratio == 0 ? 100 : 1);
        EXPECT_LE(worst, allowed) << k << " " << ratio << " " << tick;
      }
    }
  }
}

TEST(ClosedForm, AgreesWithRungeKuttaThatStopsAtTheContacts) {
  // Contact times from the closed form, the ways between them by Runge-Kutta: the guard must be zero there.
  ToyPlant plant = driven();
  plant.contacts = {{1e4, 0.4, 0.1, 1}};
  Exact exact;
  exact.start(plant, 0.3, {0.05, 0});
  std::array<double, 2> x{0.05, 0};
  for (int i = 1; i <= 600; ++i) exact.advance(plant, 0.3 + i * 1e-3);
  const double end = exact.time();
  double t = 0.3;
  Mode mode = plant.mode_at(t, x);
  constexpr int kPieces = 60000;  // of 10 us, shorter than any flight between two bounces
  for (int i = 1; i <= kPieces; ++i) {
    const double t1 = i == kPieces ? end : 0.3 + i * (end - 0.3) / kPieces;
    const auto y = runge_kutta(plant, mode, t, t1, x, 1);
    if (plant.guards(mode, t1, y)[0] >= 0) {
      x = y;
    } else {
      double low = t, high = t1;  // bisection, each trial from the start of the piece
      for (int k = 0; k < 50; ++k) {
        const double middle = (low + high) / 2;
        (plant.guards(mode, middle, runge_kutta(plant, mode, t, middle, x, 1))[0] >= 0 ? low : high) = middle;
      }
      x = runge_kutta(plant, mode, t, high, x, 1);
      mode ^= 1u;
      x = runge_kutta(plant, mode, high, t1, x, 1);
    }
    t = t1;
  }
  EXPECT_GE(exact.counters().events, 3u);
  EXPECT_NEAR(exact.state()[0], x[0], 1e-11);
  EXPECT_NEAR(exact.state()[1], x[1], 1e-9);
}

TEST(ClosedForm, KnowsEveryInstantOfTheLastAdvance) {
  ToyPlant plant = driven();
  plant.contacts = {{1e6, 0, 0.1, 1}, {1e6, 0, 0.09, -1}};  // two walls, a slit of 10 mrad
  plant.arm = 0.1;
  Exact exact;
  exact.start(plant, 0, {0.095, 2});
  for (int i = 1; i <= 30; ++i) {
    const Exact before = exact;
    exact.advance(plant, i * 5e-3);
    for (const double part : {0.0, 0.1, 0.5, 0.77, 0.999, 1.0}) {
      Exact partial = before;
      const double t = (i - 1 + part) * 5e-3;
      partial.advance(plant, t);
      EXPECT_NEAR(exact.at(t)[0], partial.state()[0], 1e-15) << i << " " << part;
      EXPECT_NEAR(exact.at(t)[1], partial.state()[1], 2e-11) << i << " " << part;
    }
  }
  EXPECT_GT(exact.counters().events, 20u);

  ToyPlant smooth = driven();
  Exact whole;
  whole.start(smooth, 0, {0, 0});
  for (int i = 1; i <= 1500; ++i) {
    const Exact before = whole;
    whole.advance(smooth, i * 1e-3);
    if (i % 10 != 0) continue;
    Exact partial = before;
    partial.advance(smooth, (i - 0.3) * 1e-3);
    EXPECT_NEAR(whole.at((i - 0.3) * 1e-3)[0], partial.state()[0], 1e-15);
    EXPECT_NEAR(whole.at((i - 0.3) * 1e-3)[1], partial.state()[1], 1e-14);
  }
}

// ---- dry friction: the state is reset, and the held input moves a guard ----

// Modes: 0 sticks, 1 slips in +, 2 slips in -.
struct DryPlant {
  static constexpr std::size_t kStates = 2, kGuards = 1;
  using State = std::array<double, 2>;
  double J = 0.01, k = 10, static_friction = 0.6, kinetic_friction = 0.5, input = 0;

  const char* not_affine() const noexcept { return nullptr; }
  template <class T>
  AffineFlow<T, 2> flow(Mode mode) const noexcept {
    if (mode == 0) return {};
    const T friction = mode == 1 ? T(kinetic_friction) : -T(kinetic_friction);
    return {{{{T(0), T(1)}, {-T(k) / T(J), T(0)}}}, {T(0), (T(input) - friction) / T(J)}, {}};
  }
  template <class T>
  Forcing<T> forcing(double) const noexcept {
    return {};
  }
  template <class T>
  std::array<AffineGuard<T, 2>, 1> guard_forms(Mode mode) const noexcept {
    using Guard = AffineGuard<T, 2>;
    const T F = T(static_friction);
    if (mode == 0) return {Guard{Guard::Kind::kMin, {{-T(k), 0}, F + T(input), 0}, {{T(k), 0}, F - T(input), 0}}};
    return {Guard{Guard::Kind::kOne, {{0, mode == 1 ? T(1) : T(-1)}, 0, 0}, {}}};
  }
  Mode mode_at(double, const State& x) const noexcept {
    if (x[1] != 0) return x[1] > 0 ? 1 : 2;
    const double torque = input - k * x[0];
    return std::fabs(torque) <= static_friction ? 0 : torque > 0 ? 1 : 2;
  }
  Mode cross(Mode, std::size_t, double t, State& x) const noexcept {
    x[1] = 0;
    return mode_at(t, x);
  }
  State derivative(Mode, double, const State&) const noexcept { return {}; }
  StateMatrix<2> jacobian(Mode, double, const State&) const noexcept { return {}; }
  State time_derivative(Mode, double, const State&) const noexcept { return {}; }
  std::array<double, 1> guards(Mode, double, const State&) const noexcept { return {}; }
  double next_break(double) const noexcept { return std::numeric_limits<double>::infinity(); }
};

TEST(ClosedForm, SticksAndSlipsWithDryFriction) {
  DryPlant plant;
  ClosedForm<DryPlant> exact;
  exact.start(plant, 0, {0.5, 0});
  EXPECT_EQ(exact.mode(), 2u);
  // Each half swing ends 2 F / k = 0.1 rad nearer: 0.5, -0.4, 0.3, -0.2, 0.1, and rests at 0: the spring pulls less
  // than 0.6 N m only there... at 0.1 it pulls 1 N m, so one more swing ends at 0.
  const double half = std::numbers::pi * std::sqrt(plant.J / plant.k);
  const double turns[] = {-0.4, 0.3, -0.2, 0.1, 0.0};
  int tick = 0;
  for (int i = 0; i < 5; ++i) {
    const double end = half * (i + 1);
    while ((tick + 1) * 1e-3 < end) exact.advance(plant, ++tick * 1e-3);
    EXPECT_NEAR(exact.at(tick * 1e-3)[0], turns[i], 2e-3);
    exact.advance(plant, end);
    EXPECT_NEAR(exact.state()[0], turns[i], 1e-14);
  }
  for (int i = 0; i < 100; ++i) exact.advance(plant, ++tick * 1e-3);
  EXPECT_EQ(exact.mode(), 0u);
  EXPECT_EQ(exact.state()[1], 0.0);
  EXPECT_EQ(exact.counters().events, 5u);

  // Pushed by more and more, in steps too small to let go at 0.6 N m, until one does.
  plant.input = 0.5;
  exact.advance(plant, ++tick * 1e-3);
  EXPECT_EQ(exact.mode(), 0u);
  plant.input = 0.7;
  exact.advance(plant, ++tick * 1e-3);
  EXPECT_EQ(exact.mode(), 1u);
  EXPECT_NEAR(exact.state()[0], 0.02 * (1 - std::cos(1e-3 / std::sqrt(plant.J / plant.k))), 1e-15);
}

TEST(ClosedForm, DoesNotChatterWhereStaticAndKineticFrictionAreEqual) {
  DryPlant plant;
  plant.static_friction = plant.kinetic_friction = 0.5;
  ClosedForm<DryPlant> exact;
  exact.start(plant, 0, {0, 0});
  for (int i = 1; i <= 3000; ++i) {
    plant.input = 0.7 * std::sin(i * 0.01);
    exact.advance(plant, i * 1e-3);
    ASSERT_EQ(exact.status(), IntegratorStatus::kOk);
  }
  EXPECT_LE(exact.counters().events, 100u);
}

}  // namespace
}  // namespace farhand
