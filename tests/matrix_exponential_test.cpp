// The augmented matrix exponential and eigenvalues against formulas derived by hand.
#include "common/integrate/matrix_exponential.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdio>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "common/integrate/eigenvalues.hpp"
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

using Complex = std::complex<double>;

// The farthest that any of `known` lies from its own one of `found`.
double worst_distance(std::vector<Complex> found, const std::vector<Complex>& known) {
  EXPECT_EQ(found.size(), known.size());
  double worst = 0;
  for (const Complex& one : known) {
    const auto nearest = std::min_element(found.begin(), found.end(), [&](const Complex& a, const Complex& b) {
      return std::abs(a - one) < std::abs(b - one);
    });
    if (nearest == found.end()) return std::numeric_limits<double>::infinity();
    worst = std::max(worst, std::abs(*nearest - one));
    found.erase(nearest);
  }
  return worst;
}

// A chain of n equal masses and springs (frequencies 2 sin(k pi / (2 n + 2))), as positions and speeds.
TEST(Eigenvalues, OfAChainOfMassesAreItsFrequencies) {
  for (const int n : {1, 2, 3, 7, 12}) {
    const int size = 2 * n;
    std::vector<double> A(static_cast<std::size_t>(size * size));
    const auto at = [&](int i, int j) -> double& { return A[static_cast<std::size_t>(i * size + j)]; };
    std::vector<Complex> known;
    for (int i = 0; i < n; ++i) {
      at(i, n + i) = 1;
      at(n + i, i) = -2;
      if (i > 0) at(n + i, i - 1) = at(n + i - 1, i) = 1;
      const double omega = 2 * std::sin((i + 1) * std::numbers::pi / (2 * n + 2));
      known.emplace_back(0, omega);
      known.emplace_back(0, -omega);
    }
    const std::vector<Complex> found = eigenvalues(A, static_cast<std::size_t>(size));
    EXPECT_LT(worst_distance(found, known), 1e-14 * size) << n;
    Complex sum = 0;
    for (const Complex& one : found) sum += one;
    EXPECT_EQ(sum.imag(), 0) << "pairs are exactly conjugate";
  }
}

// The cyclic shift maps itself onto itself under its own shifts; its eigenvalues are the roots of one.
TEST(Eigenvalues, OfACyclicMatrixAreTheRootsOfOne) {
  for (const int n : {3, 4, 5, 8, 16}) {
    std::vector<double> A(static_cast<std::size_t>(n * n));
    std::vector<Complex> known;
    for (int i = 0; i < n; ++i) {
      A[static_cast<std::size_t>((i + 1) % n * n + i)] = 1;
      known.push_back(std::polar(1.0, 2 * std::numbers::pi * i / n));
    }
    EXPECT_LT(worst_distance(eigenvalues(A, static_cast<std::size_t>(n)), known), 1e-14 * n) << n;
  }
}

// Upper triangle, then scaled by powers of two up to 2^40 apart: exact similarity, which balancing undoes.
TEST(Eigenvalues, OfBadlyScaledMatricesKeepTheirDigits) {
  std::mt19937_64 random(7);
  for (int round = 0; round < 2000; ++round) {
    const int n = 2 + static_cast<int>(random() % 7);
    std::vector<double> A(static_cast<std::size_t>(n * n)), scaled = A, scale;
    for (double& a : A) a = uniform(random, -1, 1);
    for (int i = 0; i < n; ++i) scale.push_back(std::exp2(std::round(uniform(random, -20, 20))));
    for (int i = 0; i < n * n; ++i) {
      const auto k = static_cast<std::size_t>(i);
      scaled[k] = A[k] * scale[static_cast<std::size_t>(i / n)] / scale[static_cast<std::size_t>(i % n)];
    }
    const auto size = static_cast<std::size_t>(n);
    // A double eigenvalue is known to half the digits; everything drawn here is better separated than that.
    EXPECT_LT(worst_distance(eigenvalues(scaled, size), eigenvalues(A, size)), 1e-8) << round;
  }
}

TEST(Eigenvalues, OfSmallAndDegenerateMatrices) {
  EXPECT_TRUE(eigenvalues({}, 0).empty());
  EXPECT_EQ(eigenvalues(std::vector<double>{-3.5}, 1), std::vector<Complex>{-3.5});
  EXPECT_LT(worst_distance(eigenvalues(std::vector<double>(9), 3), {0, 0, 0}), 1e-300);
  // 1 and 1e-12 without cancellation; a Jordan block of two.
  EXPECT_LT(worst_distance(eigenvalues(std::vector<double>{1, 1, 0, 1e-12}, 2), {1, 1e-12}), 1e-27);
  EXPECT_LT(worst_distance(eigenvalues(std::vector<double>{2, 1, 0, 2}, 2), {2, 2}), 1e-15);
  EXPECT_TRUE(eigenvalues(std::vector<double>{1, std::nan(""), 0, 1}, 2).empty());
  EXPECT_EQ(fastest_eigenvalue(std::vector<double>{0, 1, -4e8, 0}, 2).real(), 0);
  EXPECT_NEAR(std::abs(fastest_eigenvalue(std::vector<double>{0, 1, -4e8, 0}, 2)), 2e4, 1e-8);
}

}  // namespace
}  // namespace farhand
