// Does the energy of a simulated world balance? What drive and intention put in, less what was lost, must be found in
// what is stored. The audit integrates the power itself, along a motion of its own that starts where the world was and
// is redone in each interval, so that it does not share the steps of what it judges.
#pragma once

#include <cmath>

#include "common/integrate/rk4.hpp"

namespace farhand {

struct EnergyBalance {
  double residual_j = 0;        // stored - supplied + dissipated since the start: what the world made of nothing
  double worst_interval_j = 0;  // largest |residual| of one interval in which an input was held
  double exchanged_j = 0;       // sum of |supplied| and dissipated: the measure for the residual
};

// World: derivative(t, state) under the input held last, stored_energy(t, state), power(t, state).
template <class World>
class EnergyAudit {
 public:
  explicit EnergyAudit(double max_step_s) : max_step_s_(max_step_s) {}

  // Before the world moves, and after it moved from t0_s to t1_s under one held input.
  void before(const World& world) noexcept { x_ = world.state(); }
  void after(const World& world, double t0_s, double t1_s, EnergyBalance& balance) noexcept {
    // Gauss & Legendre with three nodes, all of them inside: at its ends an interval may meet an intended motion that
    // changes its velocity at once. Order 6.
    constexpr double kNode = 0.7745966692414834, kOuter = 5.0 / 18.0, kMiddle = 4.0 / 9.0;
    const double h = t1_s - t0_s, at[] = {0.5 - 0.5 * kNode, 0.5, 0.5 + 0.5 * kNode},
                 weight[] = {kOuter, kMiddle, kOuter};
    const double stored = world.stored_energy(t0_s, x_);
    double supplied = 0, exchanged = 0, dissipated = 0, t = t0_s;
    for (int i = 0; i < 3; ++i) {
      rk4_advance(world, x_, t, t0_s + at[i] * h, max_step_s_);
      t = t0_s + at[i] * h;
      const auto flow = world.power(t, x_);
      supplied += weight[i] * h * flow.supplied;
      dissipated += weight[i] * h * flow.dissipated;
      exchanged += weight[i] * h * (std::fabs(flow.supplied) + flow.dissipated);
    }
    const double residual = world.stored_energy(t1_s, world.state()) - stored - supplied + dissipated;
    balance.residual_j += residual;
    balance.worst_interval_j = std::fmax(balance.worst_interval_j, std::fabs(residual));
    balance.exchanged_j += exchanged;
  }

 private:
  typename World::State x_{};
  double max_step_s_;
};

}  // namespace farhand
