// The loop of one side with a motor that takes a torque, as the station runs it: derivative, DOB and RTOB as backward
// Euler filters that see the torque of the last period, and the four-channel law with the remote motion standing still:
//
//   tau(n) = J_n [-K_p x(n) - K_d v(n) - K_f f(n)] + tau_dis(n),   held for dt on  J x'' + b x' + k x = tau
//
// k and b are what the axis touches (hand, wall, the therapist's arm) besides its own friction. All is linear, so that
// the roots of one polynomial say whether it comes to rest.
#pragma once

#include "common/analysis/held_axis.hpp"

namespace farhand {

struct SideLoop {
  Axis axis;
  double dt = 1e-3;  // s
  double J_n = 4e-3;
  double viscous = 0.0;                    // that the RTOB subtracts
  double K_p = 0.0, K_d = 0.0, K_f = 0.0;  // all 0: the DOB alone
  double g_dis = 200.0, g_reac = 200.0, g_v = 500.0;
};

// In z, without the roots at exactly 1 that only say that a position, or a torque, may stand anywhere.
Polynomial characteristic(const SideLoop& loop);

// Below 1: comes to rest.
inline double spectral_radius(const SideLoop& loop) { return spectral_radius(characteristic(loop)); }

// DOB alone on a free rotor without friction:  J_n/J g dt/(1 + g dt) < 2,  whatever the cut-off of the velocity. So it
// is stable at every g up to J_n/J = 2; this is the largest g_dis dt beyond, or +inf.
double dob_limit(double inertia_ratio);

// RMS of the torque, in N m, that an encoder with this many counts per revolution leaves in it while the axis moves
// over its counts at random; the loop must be stable. 0 counts: 0.
double encoder_noise(const SideLoop& loop, double counts_per_rev);

}  // namespace farhand
