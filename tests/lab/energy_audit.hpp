// Does the energy of a simulated world balance? What drive and intention put in, less what was lost, must be found in
// what is stored. A second world that gets the same inputs in shorter pieces tells the power in between, so that the
// audit does not share the steps of what it judges.
#pragma once

#include <cmath>

#include "common/plant/world.hpp"

namespace farhand {

struct EnergyBalance {
  double residual_j = 0;        // stored - supplied + dissipated since the start: what the world made of nothing
  double worst_interval_j = 0;  // largest |residual| of one interval in which an input was held
  double exchanged_j = 0;       // sum of |supplied| and dissipated: the measure for the residual
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
    double supplied = 0, dissipated = 0, exchanged = 0;
    for (int i = 0; i < 3; ++i) {
      second_.advance(input, t0_s + kAt[i] * h);
      const PowerFlow flow = second_.power();
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
  }

 private:
  World second_;
  double stored_;
};

}  // namespace farhand
