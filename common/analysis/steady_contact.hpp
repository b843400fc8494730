// The state of rest of both sides when the therapist aims at an angle that the slave's contact resists. The laws at
// standstill give K_p x_cdob = K_f f_s (model THESIS). Hence f_m = -(1 - alpha/2) f_s, and
//
//   f_s = K_h (x_int - x_rest) / (1 + K_h/k + alpha/2 (K_h K_f/K_p - 1))
//
// alpha is the SDCV's share of the compensation: 1 for CDOB alone, 0 without it.
#pragma once

namespace farhand {

struct SteadyContact {
  double K_h = 3;      // N m/rad, of the therapist's arm
  double reach = 0.3;  // rad, x_int - x_rest; its sign does not matter here
  double k = 2;        // N m/rad, of the object that the slave touches; above 0
  double K_p = 400, K_f = 250;

  double slave_torque(double alpha) const;
  double master_torque(double alpha) const { return (1.0 - 0.5 * alpha) * slave_torque(alpha); }
};

// The value at which alpha, falling from 1, comes to rest between the thresholds.
double resting_alpha(const SteadyContact& contact, double f_1, double f_2);

// Largest f_2 with which the compensation is released (alpha below 0.01); a result not above f_1 means that there is
// none.
double largest_f_2(const SteadyContact& contact, double f_1);

}  // namespace farhand
