// Limits found by simulation: the station's drive on an axis with exact motion, a device at a sampled wall, a hand that
// tries to draw energy from the wall. This code is independent of common/analysis.
#pragma once

#include <cmath>

#include "common/analysis/sampled_wall.hpp"
#include "common/analysis/side_loop.hpp"

namespace farhand {

// An axis that is pushed to 0.01 rad/s under the station's own DOB, RTOB and law; the remote side is at rest.
bool comes_to_rest(const SideLoop& loop, int ticks = 6000);

// A device let go at rest, 1 mrad inside the wall.
bool dies_out(const SampledWall& wall, double K);

enum class Between { kStraight, kSine };

// Energy that a hand puts into device and wall over whole periods of a motion whose samples are cos(theta n), in
// N m per rad^2: the least over the frequencies of 100 samples. Between the samples the hand moves straight, which of
// all motions through them loses least to friction, or as a sine.
double least_energy(const SampledWall& wall, double K, Between between);

// The boundary of holds(p), by halving the ratio between about half and twice the expected value.
template <class Holds>
double simulated_limit(double expected, const Holds& holds, int halvings = 9) {
  double low = 0.55 * expected, high = 2.1 * expected;
  for (int i = 0; i < halvings; ++i) {
    const double middle = std::sqrt(low * high);
    (holds(middle) ? low : high) = middle;
  }
  return std::sqrt(low * high);
}

}  // namespace farhand
