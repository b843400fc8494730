// Where both sides come to rest when the therapist means to be at an angle that the slave's contact resists. From the
// laws at standstill: K_p x_cdob = K_f f_s (model THESIS), so that f_m = -(1 - alpha/2) f_s, and
//
//   f_s = K_h (x_int - x_rest) / (1 + K_h/k + alpha/2 (K_h K_f/K_p - 1))
//
// alpha is the SDCV's share of the compensation: 1 for CDOB alone, 0 without it.
#pragma once

namespace farhand {

struct SteadyContact {
  double K_h = 3;      // N m/rad, of the therapist's arm
  double reach = 0.3;  // rad, x_int - x_rest; its sign does not matter here
  double k = 2;        // N m/rad, of what the slave touches; above 0
  double K_p = 400, K_f = 250;

  double slave_torque(double alpha) const;
  double master_torque(double alpha) const { return (1.0 - 0.5 * alpha) * slave_torque(alpha); }
};

// Where alpha, sinking from 1, comes to rest between the thresholds.
double resting_alpha(const SteadyContact& contact, double f_1, double f_2);

// Largest f_2 with which the compensation is let go (alpha below 0.01); not above f_1 if none does.
double largest_f_2(const SteadyContact& contact, double f_1);

}  // namespace farhand
