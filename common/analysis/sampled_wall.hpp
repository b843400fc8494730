// A wall that a computer renders: tau(n) = -K x(n) - B (x(n) - x(n-1))/T, held for one period T, on a device of inertia
// J and viscous friction b. There are two different limits on K. Up to the first the device alone comes to rest at the
// wall (stability). Up to the second no user can gain energy from the wall, however he moves (passivity) (Daud 2011,
// 2.8; Colgate and Schenkel 1997).
#pragma once

namespace farhand {

struct SampledWall {
  double J = 4e-3;  // kg m2
  double b = 0.05;  // N m s/rad
  double T = 1e-3;  // s
  double B = 0;     // N m s/rad
};

// Spectral radius of the exact sampled loop with stiffness K.
double spectral_radius(const SampledWall& wall, double K);

// The largest K such that the loop is stable for all stiffnesses from 0 to K; 0 if it is unstable at 0.
double stability_limit(const SampledWall& wall);

// The K at which  b = max over w in (0, pi/T] of (T/2) Re{(1 - e^{-jwT}) H(e^{jwT})} / (1 - cos wT),
// H(z) = K + B (z - 1)/(T z); found by a search over w that works for any H. 0 if B alone needs more than b.
double passivity_limit(const SampledWall& wall);

// For this H the maximum stands at w = pi/T for B > 0 and at w -> 0 for B < 0:  b = K T/2 + |B|.
double passivity_limit_closed_form(const SampledWall& wall);

}  // namespace farhand
