// The detector of a shaken hand against its transfer function, against what hands do on purpose, and against encoders.
#include "common/observer/oscillation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <cstdio>
#include <numbers>

#include "common/signal/derivative.hpp"

namespace farhand {
namespace {

using J1 = Joints<1>;
constexpr double kTwoPi = 2 * std::numbers::pi, kDt = 1e-3, kFastest = 4.0, kReach = 0.349;
constexpr double kLimit = OscillationParams{}.limit;

// LP: a / (1 - (1 - a) z^-1) at z = exp(j w dt); HP = 1 - LP.
double low_pass(double g, double hz, double dt) {
  const double a = g * dt / (1 + g * dt);
  return std::abs(a / (1.0 - (1.0 - a) * std::polar(1.0, -kTwoPi * hz * dt)));
}
double band(double hz, double dt = kDt) {
  const double g = kTwoPi * 4, a = g * dt / (1 + g * dt);
  const double high_pass = std::abs(1.0 - a / (1.0 - (1.0 - a) * std::polar(1.0, -kTwoPi * hz * dt)));
  return std::pow(high_pass, 4) * std::pow(low_pass(kTwoPi * 60, hz, dt), 2);
}

struct Seen {
  double most = 0, settled = 0;  // of rms(); the latter RMS over its last second
};
// v(t), as the observer's velocity shows it.
template <class V>
Seen seen(const V& v, double dt = kDt, bool filtered = true) {
  Oscillation oscillation({.limit = 1e9, .dt_s = dt});
  LowPass<1> observed(Cutoff::rad_s(500), dt);
  Seen all;
  int count = 0;
  for (int k = 0; k * dt < 24; ++k) {
    oscillation.step(filtered ? observed.step(J1(v(k * dt)))[0] : v(k * dt), true);
    all.most = std::max(all.most, oscillation.rms());
    if (k * dt >= 23) all.settled += oscillation.rms() * oscillation.rms(), ++count;
  }
  all.settled = std::sqrt(all.settled / count);
  return all;
}
auto sine(double amplitude, double hz, double from_s = 0) {
  return [=](double t) { return t < from_s ? 0 : amplitude * kTwoPi * hz * std::cos(kTwoPi * hz * (t - from_s)); };
}

TEST(Oscillation, HasTheResponseOfItsTransferFunction) {
  for (const double dt : {1e-3, 0.5e-3}) {
    for (const double hz : {1.0, 2.0, 3.0, 4.0, 5.0, 8.0, 12.0, 20.0, 50.0, 100.0}) {
      const double v = 0.7 / std::numbers::sqrt2 * band(hz, dt);
      // exp(-23) of the start is left.
      EXPECT_NEAR(seen([&](double t) { return 0.7 * std::sin(kTwoPi * hz * t); }, dt, false).settled, v, 1e-8 * v);
    }
  }
}

// The limit is made of these; a test that fails says that the derivation in the header no longer holds.
TEST(Oscillation, TheLimitIsWhatAHandDoesThatNobodyShakes) {
  // A sine that begins with all its speed, as no arm does, and smooth strokes of a quarter of a second to and fro.
  const auto smooth = [](double t) {
    const double s = std::fmod(t / 0.25, 1.0), way = std::fmod(t, 0.5) < 0.25 ? 1 : -1;
    return way * 30 * 2 * kReach / 0.25 * std::pow(s * (1 - s), 2);
  };
  const double stroke = std::max(seen(sine(kReach, 2, 0.5)).most, seen(smooth).most);
  const double stop = seen([](double t) { return t < 1 ? kFastest * std::min(1.0, 2 * t) : 0; }).most;
  double tremor = 0;
  for (double hz = 4; hz <= 12; hz += 0.5) tremor = std::max(tremor, seen(sine(5e-3, hz)).settled);
  const double sum = std::hypot(std::hypot(stroke, stop), tremor);
  std::printf("stroke %.3f, stop %.3f, tremor %.3f, together %.3f rad/s\n", stroke, stop, tremor, sum);
  EXPECT_LE(sum, kLimit);
  EXPECT_GE(sum, 0.9 * kLimit) << "no laxer than derived";
}

// At f counts a second the n-th harmonic of the error of a staircase has a velocity of 2 q f.
TEST(Oscillation, ASteadyMotionThroughCountsIsNoShaking) {
  double bound = 0;
  for (double f = 1; f < 120; f += 0.5) {
    double sum = 0;
    for (int n = 1; n * f < 500; ++n) sum += std::pow(2 * f * band(n * f) * low_pass(500, n * f, kDt), 2) / 2;
    bound = std::max(bound, std::sqrt(sum));
  }
  std::printf("harmonics of a staircase: %.2f q, taken off: %.0f q\n", bound, Oscillation::kStaircase);
  EXPECT_LE(bound, Oscillation::kStaircase);
  EXPECT_GE(bound, 0.9 * Oscillation::kStaircase);
  for (const double q : {kTwoPi / 256, kTwoPi / 1024}) {
    double most = 0;
    for (double speed = 0.05; speed < kFastest; speed *= 1.1) {
      Oscillation oscillation({.resolution = q});
      Derivative<1> velocity(Cutoff::rad_s(500), kDt);
      velocity.reset(J1(0));
      for (int k = 0; k < 6000; ++k) {
        oscillation.step(velocity.step(J1(q * std::floor(speed * k * kDt / q)))[0], true);
        if (k >= 5000) most = std::max(most, oscillation.rms());
      }
    }
    std::printf("1 count = %.2f mrad: at most %.3f rad/s\n", 1e3 * q, most);
    EXPECT_LE(most, 0.15 * kLimit);
  }
}

// From rest a cycle of amplitude A is noticed after -T ln(1 - (limit/r)^2), r = A |G|/sqrt(2), but for what the band
// needs to fill: the impulse of (1 - LP(4 Hz))^4 is over in 0.1 s.
TEST(Oscillation, LowersTheGainAtOnceHoldsWhatDoesNotCalmDownAndLetsGoOfWhatShakesOn) {
  for (const double amplitude : {1.6, 2.0, 8.0}) {
    Oscillation oscillation({});
    const double r = amplitude / std::numbers::sqrt2 * band(8);
    const double expected = -Oscillation::kWindow * std::log(1 - std::pow(kLimit / r, 2));
    double noticed = 0, held = 0, let_go = 0, lowest = 1, t = 0;
    for (; t < 6; t += kDt) {
      oscillation.step(amplitude * std::sin(16 * std::numbers::pi * t), true);
      if (noticed == 0 && oscillation.gain() < 1) noticed = t;
      if (held == 0 && oscillation.hold()) held = t;
      if (let_go == 0 && oscillation.let_go()) let_go = t;
      lowest = std::min(lowest, oscillation.gain());
    }
    std::printf("%.1f rad/s at 8 Hz: noticed after %.3f s (%.3f), held after %.3f s, let go after %.3f s\n", amplitude,
                noticed, expected, held, let_go);
    EXPECT_NEAR(noticed, expected, 0.1);
    // Near the limit the variance swings across it at twice the frequency for some periods.
    EXPECT_GE(held - noticed, Oscillation::kPersists - 2e-3);
    EXPECT_LE(held - noticed, Oscillation::kPersists + 0.05);
    EXPECT_NEAR(let_go - held, expected + 2 * Oscillation::kPersists, 0.1) << "judged anew";
    EXPECT_EQ(lowest, Oscillation::kLeast);
    // Calm: variance falls by exp(-t/T) to a quarter of the limit's; then the gain comes back.
    for (const double end = t + 16; t < end; t += kDt) oscillation.step(0, true);
    EXPECT_EQ(oscillation.gain(), 1.0);
    EXPECT_FALSE(oscillation.hold() || oscillation.let_go());
  }
}

TEST(Oscillation, AHandThatShakesByItselfIsNotToBeTakenButIsNoFault) {
  Oscillation oscillation({});
  for (double t = 0; t < 10; t += kDt) {
    oscillation.step(3 * std::sin(12 * std::numbers::pi * t), false);
    EXPECT_FALSE(oscillation.let_go());
  }
  EXPECT_TRUE(oscillation.hold());
  for (double t = 0; t < 6; t += kDt) oscillation.step(0, false);
  EXPECT_FALSE(oscillation.hold());
}

}  // namespace
}  // namespace farhand
