// A wall that a computer renders: tau(n) = -K x(n) - B (x(n) - x(n-1))/T, held for one period T, on a device of inertia
// J and viscous friction b. Two limits on K, and they are not the same thing: up to the first the device alone comes to
// rest at the wall, up to the second nobody can gain energy from it, whatever he does (Daud 2011, 2.8; Colgate and
// Schenkel 1997).
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

// The K below which, down to 0, the loop is stable; 0 if it is not even there.
double stability_limit(const SampledWall& wall);

// The K at which  b = max over w in (0, pi/T] of (T/2) Re{(1 - e^{-jwT}) H(e^{jwT})} / (1 - cos wT),
// H(z) = K + B (z - 1)/(T z); found over w, without using what H is. 0 if already B takes more than b gives.
double passivity_limit(const SampledWall& wall);

// For this H the maximum stands at w = pi/T for B > 0 and at w -> 0 for B < 0:  b = K T/2 + |B|.
double passivity_limit_closed_form(const SampledWall& wall);

}  // namespace farhand
