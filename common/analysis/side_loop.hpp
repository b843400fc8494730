// The loop of one side with a motor that takes a torque, as the station runs it: derivative, DOB and RTOB as backward
// Euler filters that get the torque of the last period, and the four-channel law with the remote motion at rest:
//
//   tau(n) = J_n [-K_p x(n) - K_d v(n) - K_f f(n)] + tau_dis(n),   held for dt on  J x'' + b x' + k x = tau
//
// k and b are those of the object that the axis touches (hand, wall, the therapist's arm), with the axis' own friction.
// The loop is linear, so that the roots of one polynomial decide whether it comes to rest.
#pragma once

#include <complex>

#include "common/analysis/held_axis.hpp"

namespace farhand {

struct SideLoop {
  LoadedAxis axis;
  double dt = 1e-3;  // s
  double J_n = 4e-3;
  double viscous = 0.0;                    // that the RTOB subtracts
  double K_p = 0.0, K_d = 0.0, K_f = 0.0;  // all 0: the DOB alone
  double g_dis = 200.0, g_reac = 200.0, g_v = 500.0;
};

// Characteristic polynomial in z, without the roots at exactly 1, which only mean that position or torque can rest at
// any value.
Polynomial characteristic(const SideLoop& loop);

// Below 1 the loop comes to rest.
inline double spectral_radius(const SideLoop& loop) { return spectral_radius(characteristic(loop)); }

// Largest stable g_dis dt of the DOB alone on a free rotor without friction:  J_n/J g dt/(1 + g dt) < 2,  whatever the
// cut-off of the velocity. Up to J_n/J = 2 it is stable at every g, and the result is +inf.
double dob_limit(double inertia_ratio);

// Response of the axis to an acceleration that the remote side adds to the law's (K_p x_remote + K_d v_remote - K_f
// f_remote), and to an error of its own encoder.
class SideResponse {
 public:
  using Complex = std::complex<double>;
  struct Sent {
    Complex x, v, f;  // the motion that goes to the peer
  };
  explicit SideResponse(const SideLoop& loop);

  Sent to_acceleration(Complex z) const;
  Sent to_encoder_error(Complex z) const;
  Complex torque_to_acceleration(Complex z) const;
  Complex torque_to_encoder_error(Complex z) const;
  // The acceleration that the peer's law takes from what is sent.
  Complex as_reference(const Sent& sent) const { return loop_.K_p * sent.x + loop_.K_d * sent.v - loop_.K_f * sent.f; }

 private:
  Sent sent(Complex z, Complex x_read, Complex tau) const;

  SideLoop loop_;
  double a_r_, a_v_;
  Polynomial numerator_, denominator_, characteristic_, feedback_, reference_;
};

// RMS torque, in N m, caused by the counts of two encoders: the own one, and the remote one whose motion is received.
// Errors are assumed white and uniform over a count, as for an axis in motion. 0 counts per revolution: an ideal
// encoder.
double encoder_noise(const SideLoop& loop, double counts_per_rev);
double encoder_noise(const SideLoop& loop, const SideLoop& remote, double remote_counts_per_rev);

}  // namespace farhand
