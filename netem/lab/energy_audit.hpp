// Checks the energy balance of a simulated world: energy supplied by drive and intention, less the losses, must equal
// the change of the stored energy. A second world, which gets the same inputs in shorter pieces, gives the power in
// between, so that the audit does not use the steps that it checks.
//
// The residual of an exact world has a part that grows with the time t:
//   A time t is known to ulp(t) / 2, at most eps t / 2. The audit evaluates the power by this much too early or late,
//   which changes its sum at a node by weight h |dP/dt| eps t / 2. Where a power jumps between two inputs, because the
//   intended velocity jumps, the two sides of the jump last up to eps t too long or too short. Together this is at most
//   eps t times the variation of both powers. The lengths of the steps are differences of times of similar size, and
//   exact.
// A second part does not grow:
//   Each interval rounds the state, the stored energy and the sum, at most eight times by eps / 2, relative to the
//   stored energy and to torque times angle, which is the work of moving the angle by its own rounding. The nodes leave
//   an error of h^7 / 2016000 of the sixth derivative of the power: with the motor of an orthosis, 188 1/s, and loops
//   of 0.5 ms, about 1e-14 J for each W by which a command changes the power, which is smaller.
#pragma once

#include <cmath>
#include <limits>

#include "common/plant/world.hpp"

namespace farhand {

struct EnergyBalance {
  double residual_j = 0;        // stored - supplied + dissipated since the start
  double worst_interval_j = 0;  // largest |residual| of one interval in which an input was held
  double exchanged_j = 0;       // sum of |supplied| and dissipated: the measure for the residual
  double rounding_j = 0;        // bound of the residual from rounding alone
};

template <class World>
class EnergyAudit {
 public:
  EnergyAudit(const typename World::Params& params, const WorldNumerics& numerics)
      : second_(params, numerics), stored_(second_.stored_energy()) {}

  // After the world was advanced from t0_s to t1_s under the input.
  void add(const World& world, double input, double t0_s, double t1_s, EnergyBalance& balance) noexcept {
    // Gauss-Legendre with three nodes, all inside the interval, because the intended velocity may jump at its ends.
    // Order 6.
    constexpr double kNode = 0.7745966692414834, kAt[] = {0.5 - 0.5 * kNode, 0.5, 0.5 + 0.5 * kNode};
    constexpr double kWeight[] = {5.0 / 18.0, 4.0 / 9.0, 5.0 / 18.0};
    const double h = t1_s - t0_s;
    double supplied = 0, dissipated = 0, exchanged = 0, variation = 0;
    for (int i = 0; i < 3; ++i) {
      second_.advance(input, t0_s + kAt[i] * h);
      const PowerFlow flow = second_.power();
      // The input jumps between two intervals, at the same time for all powers. Powers on which it does not act show
      // other jumps.
      variation += (i > 0 ? 1 : 2) * std::fabs(flow.dissipated - last_.dissipated);
      if (i > 0) variation += std::fabs(flow.supplied - last_.supplied);
      last_ = flow;
      supplied += kWeight[i] * h * flow.supplied;
      dissipated += kWeight[i] * h * flow.dissipated;
      exchanged += kWeight[i] * h * (std::fabs(flow.supplied) + flow.dissipated);
    }
    second_.advance(input, t1_s);
    const double stored = world.stored_energy(), residual = stored - stored_ - supplied + dissipated;
    stored_ = stored;
    balance.residual_j += residual;
    balance.worst_interval_j = std::fmax(balance.worst_interval_j, std::fabs(residual));
    balance.exchanged_j += exchanged;
    const auto truth = world.truth();
    balance.rounding_j += std::numeric_limits<double>::epsilon() *
                          (t1_s * variation + 4.0 * (std::fabs(stored) + std::fabs(truth.f * truth.x)));
  }

 private:
  World second_;
  double stored_;
  PowerFlow last_{};
};

}  // namespace farhand
