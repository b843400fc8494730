// An axis that is moved to be identified, in virtual time: the law of a station leads it along the sweeps, and the
// estimator sees what the station sees. World: MasterWorld or DirectSlaveWorld, without its encoder: noise comes before
// the rounding.
#pragma once

#include <cmath>
#include <numbers>
#include <random>

#include "common/identify/free_motion.hpp"
#include "common/identify/sweeps.hpp"
#include "common/plant/world.hpp"
#include "common/station/drive.hpp"
#include "tests/support/uniform.hpp"

namespace farhand {

struct NoisyEncoder {
  double counts_per_rev = 20000;
  double noise_counts = 0.5;  // RMS, before the rounding
  double phase = 0.0;         // counts

  double read(double x, std::mt19937_64& random) const {
    const double count = 2 * std::numbers::pi / counts_per_rev;
    // A sum of three: near enough to a normal distribution.
    const double noise = uniform(random, -1, 1) + uniform(random, -1, 1) + uniform(random, -1, 1);
    return count * (std::round(x / count + phase + noise_counts * noise) - phase);
  }
};

struct MovedAxis {
  MovedAxis() { drive.gate.torque = 0.6; }

  DriveParams drive;
  SweepsParams sweeps = {};
  NoisyEncoder encoder = {};
  double torque_per_nm = 1.0;  // what the motor really gives for what was asked
};

struct Moved {
  FreeMotionEstimate estimate;
  double furthest = 0, fastest = 0, strongest = 0;  // rad, rad/s, N m
  double ends_at = 0, ends_with = 0;                // rad from the start, rad/s
};

template <class World>
Moved move(World& world, const MovedAxis& how, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  NoisyEncoder encoder = how.encoder;
  encoder.phase = uniform(random, 0, 1);
  const double dt = how.drive.dt_s, start = world.true_x();
  DirectDrive<1> drive(how.drive);
  Sweeps sweeps(how.sweeps, dt);
  FreeMotion fit({.dt_s = dt, .resolution = 2 * std::numbers::pi / encoder.counts_per_rev});
  Moved moved;
  DirectDrive<1>::Sensed sensed;
  for (int k = 0; !sweeps.done(); ++k) {
    sensed.x[0] = encoder.read(world.true_x(), random);
    if (k == 0) {
      drive.reset(sensed);
      sweeps.begin(sensed.x[0]);
    }
    const Motion<1> local = drive.observe(sensed, 1);
    Motion<1> target = sweeps.step(1);
    target.f = -local.f;  // the position alone counts
    const double torque = drive.follow(local, target, {}, 1).torque[0];
    if (sweeps.sweeping()) fit.add(sensed.x[0], torque);
    world.advance(how.torque_per_nm * torque, (k + 1) * dt);
    moved.furthest = std::max(moved.furthest, std::abs(world.true_x()));
    moved.fastest = std::max(moved.fastest, std::abs(world.true_v()));
    moved.strongest = std::max(moved.strongest, std::abs(torque));
  }
  moved.ends_at = world.true_x() - start;
  moved.ends_with = world.true_v();
  moved.estimate = fit.estimate();
  return moved;
}

}  // namespace farhand
