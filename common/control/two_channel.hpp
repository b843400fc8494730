// Two channels, position one way and force the other (Daud 2011, 4.4.1, 5.3.1). The master is held to where the slave
// was; the slave gives the torque that this took. Stable over short delays only: the one loop goes through both.
//
//   tau_m = -F,   F = K_2 (x_m - x_s^d) + B_2 (v_m - v_s^d)          tau_s = F^d - B_slave v_s
#pragma once

#include "common/control/params.hpp"
#include "common/signal/motion.hpp"

namespace farhand {

// What the master gives against the therapist, N m. Positive where the master is ahead of the slave.
template <int N>
Joints<N> held_to(const TwoChannelParams& p, const Motion<N>& local, const Motion<N>& received) noexcept {
  return p.K_2 * (local.x - received.x) + p.B_2 * (local.v - received.v);
}

}  // namespace farhand
