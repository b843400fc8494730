// Does the energy of a simulated world balance? What drive and intention put in, less what was lost, must be found in
// what is stored. A second world that gets the same inputs in shorter pieces tells the power in between, so that the
// audit does not share the steps of what it judges.
//
// What may be left of a world that is exact, and grows with the time of day:
//   A time t is kept to ulp(t) / 2, at most eps t / 2. So the audit looks at the power that much too early or late, and
//   its sum over a node moves by weight h |dP/dt| eps t / 2; and where a power jumps between two inputs, because what
//   is intended takes up its velocity at once, the two sides of the jump have up to eps t more or less than they
//   should. Together at most eps t times the variation of both powers. The lengths of the steps are differences of
//   times of like size, and exact.
// And what does not grow:
//   Each interval rounds the state, what is stored and the sum, eight times by eps / 2 at most: of what is stored, and
//   of torque times angle, which is the work that it takes to move the angle by its own rounding. The nodes leave
//   h^7 / 2016000 of the sixth derivative of the power besides: with the motor of an orthosis, 188 1/s, and loops of
//   0.5 ms some 1e-14 J for each W by which a command changes the power, which is below that.
#pragma once

#include <cmath>
#include <limits>

#include "common/plant/world.hpp"

namespace farhand {

struct EnergyBalance {
  double residual_j = 0;        // stored - supplied + dissipated since the start: what the world made of nothing
  double worst_interval_j = 0;  // largest |residual| of one interval in which an input was held
  double exchanged_j = 0;       // sum of |supplied| and dissipated: the measure for the residual
  double rounding_j = 0;        // what rounding alone can leave of the residual
};

template <class World>
class EnergyAudit {
 public:
  EnergyAudit(const typename World::Params& params, const WorldNumerics& numerics)
      : second_(params, numerics), stored_(second_.stored_energy()) {}

  // After the world was advanced from t0_s to t1_s under the input.
  void add(const World& world, double input, double t0_s, double t1_s, EnergyBalance& balance) noexcept {
    // Gauss & Legendre with three nodes, all of them inside: at its ends an interval may meet an intended motion that
    // changes its velocity at once. Order 6.
    constexpr double kNode = 0.7745966692414834, kAt[] = {0.5 - 0.5 * kNode, 0.5, 0.5 + 0.5 * kNode};
    constexpr double kWeight[] = {5.0 / 18.0, 4.0 / 9.0, 5.0 / 18.0};
    const double h = t1_s - t0_s;
    double supplied = 0, dissipated = 0, exchanged = 0, variation = 0;
    for (int i = 0; i < 3; ++i) {
      second_.advance(input, t0_s + kAt[i] * h);
      const PowerFlow flow = second_.power();
      // The input jumps between two intervals, at the same time for all. What it does not act on tells of other jumps.
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
