// The augmented matrix exponential against formulas derived by hand.
#include "common/integrate/matrix_exponential.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <random>

#include "tests/support/oscillator.hpp"
#include "tests/support/uniform.hpp"

namespace farhand {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

TEST(MatrixExponential, AgreesWithTheOscillatorAtAllDampingsAndStiffnesses) {
  double worst = 0;
  for (const double ratio : {0.0, 0.01, 0.5, 0.99, 1.0, 1.01, 2.0, 50.0}) {
    for (const double turns : {1e-9, 1e-3, 0.05, 1.0, 16.0, 160.0, 1e4, 1e6}) {
      const Real t = 1e-3L, omega = static_cast<Real>(turns) / t;
      const Real omega2 = omega * omega, sigma = std::sqrt(omega2) * static_cast<Real>(ratio);
      const SquareMatrix<Real, 2> A{{{0, 1}, {-omega2, -2 * sigma}}};
      const auto response = respond<Real, 2>(A, {}, 0, t);
      const auto Phi = Oscillator{ratio == 1.0 ? sigma * sigma : omega2, sigma}.at(t);
      // Entries in units of 1 and omega; the phase of an oscillation of so many turns is no better known than this.
      const Real allowed = static_cast<Real>(kEpsilon) +
                           std::numeric_limits<Real>::epsilon() * static_cast<Real>(200 + 40 * turns * (1 + ratio));
      const Real error[4] = {response.D[0][0] + 1 - Phi[0][0], (response.D[0][1] - Phi[0][1]) * omega,
                             (response.D[1][0] - Phi[1][0]) / omega, response.D[1][1] + 1 - Phi[1][1]};
      for (const Real e : error) {
        EXPECT_LE(std::fabs(e), allowed) << "damping ratio " << ratio << ", omega t " << turns;
        if (std::isfinite(static_cast<double>(e))) worst = std::max(worst, static_cast<double>(std::fabs(e) / allowed));
      }
    }
  }
  std::printf("worst error: %.3f of what is allowed\n", worst);
}

TEST(MatrixExponential, KeepsASlowMotionBesideOneAMillionTimesFaster) {
  // Overdamped: rates 1e6 and 1 per second over 1 s.
  const Real fast = 1e6L, slow = 1;
  const SquareMatrix<double, 2> A{{{0, 1}, {-static_cast<double>(fast * slow), -static_cast<double>(fast + slow)}}};
  const SquareMatrix<Real, 2> wide{{{0, 1}, {-fast * slow, -(fast + slow)}}};
  const auto response = respond<Real, 2>(wide, {}, 0, 1);
  const Real expected = fast * std::exp(-slow) / (fast - slow);
  EXPECT_NEAR(static_cast<double>((response.D[0][0] + 1) / expected - 1), 0.0, 1e-14);
  const auto narrow = respond<double, 2>(A, {}, 0, 1);
  std::printf("relative error in long double %.2Lg, in double %.2Lg\n", (response.D[0][0] + 1) / expected - 1,
              (static_cast<Real>(narrow.D[0][0]) + 1) / expected - 1);
}

TEST(MatrixExponential, RespondsToPowersAndSinesAsTheIntegralsSay) {
  // A double integrator: the response of the velocity to s^j is t^(j+1)/(j+1), of the position t^(j+2)/(j+1)(j+2).
  const SquareMatrix<Real, 2> A{{{0, 1}, {0, 0}}};
  const Real t = 7, omega = 3;
  const auto response = respond<Real, 2>(A, {0, 1}, omega, t);
  for (std::size_t j = 1; j <= 5; ++j) {
    const Real n = static_cast<Real>(j + 1), power = std::pow(t, n) / n;
    EXPECT_NEAR(static_cast<double>(response.power[j - 1][1] / power), 1.0, 1e-17);
    EXPECT_NEAR(static_cast<double>(response.power[j - 1][0] / (power * t / (n + 1))), 1.0, 1e-17);
  }
  EXPECT_NEAR(static_cast<double>(response.sine[1] - (1 - std::cos(omega * t)) / omega), 0.0, 1e-17);
  EXPECT_NEAR(static_cast<double>(response.sine[0] - (t / omega - std::sin(omega * t) / omega / omega)), 0.0, 1e-17);
  EXPECT_NEAR(static_cast<double>(response.cosine[1] - (std::sin(omega * t) / omega - t)), 0.0, 1e-17);
}

TEST(MatrixExponential, BoundsHoldAllAlongTheWay) {
  std::mt19937_64 bits(1);
  for (int i = 0; i < 300; ++i) {
    const double omega = log_uniform(bits, 0.1, 3e5), sigma = omega * uniform(bits, 0.0, 2.0);
    const SquareMatrix<double, 2> A{{{0, 1}, {-omega * omega, -2 * sigma}}};
    const double t = 1e-3;
    // Rows that look at the angle, at the speed, and at what a wall of some damping pushes with.
    const std::array<std::array<double, 2>, 3> rows{{{1, 0}, {0, 1}, {omega, uniform(bits, 0.0, 3.0)}}};
    const auto whole = respond<double, 2>(A, {}, 0, t, rows);
    for (int k = 1; k <= 200; ++k) {
      const auto part = respond<double, 2>(A, {}, 0, t * k / 200);
      for (std::size_t r = 0; r < 3; ++r) {
        for (std::size_t c = 0; c < 2; ++c) {
          const double seen = rows[r][0] * part.Psi[0][c] + rows[r][1] * part.Psi[1][c];
          ASSERT_LE(std::fabs(seen), whole.reach[r][c] * (1 + 1e-9)) << omega << " " << sigma;
        }
      }
    }
  }
}

}  // namespace
}  // namespace farhand
