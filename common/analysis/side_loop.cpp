#include "common/analysis/side_loop.hpp"

#include <cmath>
#include <limits>
#include <numbers>

namespace farhand {
namespace {

double smoothing(double g, double dt) { return g * dt / (1.0 + g * dt); }

// With a = g dt/(1 + g dt) and everything multiplied by (z-1+a)(z-1+a_r)(z-1+a_v), the DOB turns
// tau = J_n a_ref + tau_dis into  A tau = -(V v + X x)  and v = a_v (z-1)/(dt (z-1+a_v)) x.
struct Law {
  Polynomial A;         // of the torque, with the factor (z-1+a_v)
  Polynomial feedback;  // of x
};

Law law(const SideLoop& loop) {
  const double a = smoothing(loop.g_dis, loop.dt), a_r = smoothing(loop.g_reac, loop.dt),
               a_v = smoothing(loop.g_v, loop.dt);
  const Polynomial z{0.0, 1.0}, z_1{-1.0, 1.0}, z_a{a - 1.0, 1.0}, z_r{a_r - 1.0, 1.0}, z_v{a_v - 1.0, 1.0};
  const double force = loop.J_n * loop.K_f;
  const Polynomial A = z_1 * z_r + force * a_r * z_a;
  const Polynomial V = loop.J_n * a / loop.dt * z_1 * z_r + loop.J_n * loop.K_d * z_a * z_r +
                       -force * a_r * z_a * (loop.viscous * z + loop.J_n / loop.dt * z_1);
  const Polynomial X = loop.J_n * loop.K_p * z_a * z_r;
  return {A * z_v, a_v / loop.dt * z_1 * V + z_v * X};
}

int neutral_roots(const SideLoop& loop) {
  if (loop.K_p != 0.0) return 0;
  if (loop.axis.k != 0.0) return loop.K_f == 0.0 ? 1 : 0;
  if (loop.K_d != 0.0) return 1;
  return loop.K_f == 0.0 || (loop.axis.b == 0.0 && loop.viscous == 0.0) ? 2 : 1;
}

}  // namespace

Polynomial characteristic(const SideLoop& loop) {
  const HeldAxis axis(loop.axis, loop.dt);
  const auto [A, feedback] = law(loop);
  Polynomial p = axis.denominator() * A + axis.numerator() * feedback;
  for (int i = neutral_roots(loop); i > 0; --i) p = without_root_at_one(p);
  return p;
}

double dob_limit(double inertia_ratio) {
  return inertia_ratio > 2.0 ? 2.0 / (inertia_ratio - 2.0) : std::numeric_limits<double>::infinity();
}

SideResponse::SideResponse(const SideLoop& loop)
    : loop_(loop), a_r_(smoothing(loop.g_reac, loop.dt)), a_v_(smoothing(loop.g_v, loop.dt)) {
  const HeldAxis axis(loop.axis, loop.dt);
  const double a = smoothing(loop.g_dis, loop.dt);
  const auto [A, feedback] = law(loop);
  numerator_ = axis.numerator();
  denominator_ = axis.denominator();
  feedback_ = feedback;
  characteristic_ = denominator_ * A + numerator_ * feedback;
  reference_ = loop.J_n * Polynomial{a - 1.0, 1.0} * Polynomial{a_r_ - 1.0, 1.0} * Polynomial{a_v_ - 1.0, 1.0};
}

SideResponse::Complex SideResponse::torque_to_acceleration(Complex z) const {
  return value(reference_, z) * value(denominator_, z) / value(characteristic_, z);
}

SideResponse::Complex SideResponse::torque_to_encoder_error(Complex z) const {
  return -value(feedback_, z) * value(denominator_, z) / value(characteristic_, z);
}

SideResponse::Sent SideResponse::sent(Complex z, Complex x_read, Complex tau) const {
  const Complex v = a_v_ / loop_.dt * (z - 1.0) / (z - 1.0 + a_v_) * x_read;
  const Complex f = a_r_ * (tau - (loop_.viscous * z + loop_.J_n / loop_.dt * (z - 1.0)) * v) / (z - 1.0 + a_r_);
  return {x_read, v, f};
}

SideResponse::Sent SideResponse::to_acceleration(Complex z) const {
  const Complex tau = torque_to_acceleration(z);
  return sent(z, value(numerator_, z) * value(reference_, z) / value(characteristic_, z), tau);
}

SideResponse::Sent SideResponse::to_encoder_error(Complex z) const {
  const Complex tau = torque_to_encoder_error(z);
  return sent(z, 1.0 - value(numerator_, z) * value(feedback_, z) / value(characteristic_, z), tau);
}

namespace {

// RMS of what comes out for white errors of one count.
template <class Response>
double noise(double counts_per_rev, const Response& response) {
  if (!(counts_per_rev > 0.0)) return 0.0;
  constexpr int kPoints = 128;
  double sum = 0.0;
  for (int i = 0; i < kPoints; ++i) sum += std::norm(response(std::polar(1.0, std::numbers::pi * (i + 0.5) / kPoints)));
  return 2.0 * std::numbers::pi / counts_per_rev * std::sqrt(sum / kPoints / 12.0);
}

}  // namespace

double encoder_noise(const SideLoop& loop, double counts_per_rev) {
  const SideResponse own(loop);
  return noise(counts_per_rev, [&](std::complex<double> z) { return own.torque_to_encoder_error(z); });
}

double encoder_noise(const SideLoop& loop, const SideLoop& remote, double remote_counts_per_rev) {
  const SideResponse own(loop), other(remote);
  return noise(remote_counts_per_rev, [&](std::complex<double> z) {
    return own.torque_to_acceleration(z) * other.as_reference(other.to_encoder_error(z));
  });
}

}  // namespace farhand
