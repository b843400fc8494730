#include "common/analysis/sampled_wall.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

#include "common/analysis/bisect.hpp"
#include "common/analysis/held_axis.hpp"

namespace farhand {
namespace {

// b that takes all energy that the wall of stiffness K gives in motion sampled at theta = w T.
double needed_damping(const SampledWall& wall, double K, double theta) {
  const std::complex<double> z = std::polar(1.0, theta);
  const std::complex<double> H = K + wall.B / wall.T * (z - 1.0) / z;
  const double s = std::sin(0.5 * theta);  // 1 - cos theta without its cancellation
  return 0.5 * wall.T * std::real((1.0 - 1.0 / z) * H) / (2.0 * s * s);
}

double needed_damping(const SampledWall& wall, double K) {
  constexpr int kGrid = 1000;
  constexpr double kLowest = 1e-3;  // rad per sample
  double most = -std::numeric_limits<double>::infinity();
  for (int i = 0; i <= kGrid; ++i) {
    const double theta = kLowest + (std::numbers::pi - kLowest) * i / kGrid;
    most = std::max(most, needed_damping(wall, K, theta));
  }
  return most;
}

}  // namespace

double spectral_radius(const SampledWall& wall, double K) {
  const HeldAxis axis({wall.J, wall.b, 0.0}, wall.T);
  // z tau = -((K + B/T) z - B/T) x
  return spectral_radius(Polynomial{0.0, 1.0} * axis.denominator() +
                         Polynomial{-wall.B / wall.T, K + wall.B / wall.T} * axis.numerator());
}

double stability_limit(const SampledWall& wall) {
  const auto stable = [&](double K) { return spectral_radius(wall, K) < 1.0; };
  // The fastest that one sample can be answered: K T^2 / J = 4 is the limit of an undamped, undelayed spring.
  return first_failure(stable, 1e-6 * wall.J / (wall.T * wall.T), 16.0 * wall.J / (wall.T * wall.T));
}

double passivity_limit(const SampledWall& wall) {
  const auto passive = [&](double K) { return needed_damping(wall, K) < wall.b; };
  // What is needed is the largest of straight lines in K, so it is passed once only.
  return first_failure(passive, 1e-9 * wall.b / wall.T, 16.0 * wall.b / wall.T, 4.0, 40);
}

double passivity_limit_closed_form(const SampledWall& wall) {
  return std::max(0.0, 2.0 / wall.T * (wall.b - std::abs(wall.B)));
}

}  // namespace farhand
