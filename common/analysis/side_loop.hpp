// The loop of one side with a motor that takes a torque, as the station runs it: derivative, DOB and RTOB as backward
// Euler filters that see the torque of the last period, and the four-channel law with the remote motion standing still:
//
//   tau(n) = J_n [-K_p x(n) - K_d v(n) - K_f f(n)] + tau_dis(n),   held for dt on  J x'' + b x' + k x = tau
//
// k and b are what the axis touches (hand, wall, the therapist's arm) besides its own friction. All is linear, so that
// the roots of one polynomial say whether it comes to rest.
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

// In z, without the roots at exactly 1 that only say that a position, or a torque, may stand anywhere.
Polynomial characteristic(const SideLoop& loop);

// Below 1: comes to rest.
inline double spectral_radius(const SideLoop& loop) { return spectral_radius(characteristic(loop)); }

// DOB alone on a free rotor without friction:  J_n/J g dt/(1 + g dt) < 2,  whatever the cut-off of the velocity. So it
// is stable at every g up to J_n/J = 2; this is the largest g_dis dt beyond, or +inf.
double dob_limit(double inertia_ratio);

// How the axis answers an acceleration that the remote side adds to the law's (K_p x_remote + K_d v_remote - K_f
// f_remote), and an error of its own encoder.
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

// RMS of the torque, in N m, that the counts of the encoders leave in it: of its own and of the remote one, whose
// motion is received. Errors count as white and uniform over a count, which is what an axis on the move reads. 0 counts
// per revolution: none.
double encoder_noise(const SideLoop& loop, double counts_per_rev);
double encoder_noise(const SideLoop& loop, const SideLoop& remote, double remote_counts_per_rev);

}  // namespace farhand
