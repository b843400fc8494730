#include "common/analysis/teleoperator.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

namespace farhand {
namespace {

using Complex = std::complex<double>;

// Zeros of 1 + open(z) outside the circle of this radius, if open has no poles there: how often 1 + open runs around 0
// while z runs around the circle. open is real on the real axis, so half of it is enough. delay: ticks that open turns
// with z.
template <class Open>
int zeros_outside(const Open& open, int delay, double radius) {
  constexpr double kLowest = 1e-5;
  double turned = 0.0, theta = kLowest;
  Complex before = 1.0 + open(std::polar(radius, theta));
  while (theta < std::numbers::pi) {
    // Where the loop is small it cannot run around 0, however fast the delay turns it.
    const double slow = std::abs(before - 1.0) > 0.3 ? 0.1 / (delay + 10.0) : std::numbers::pi;
    theta = std::min(theta + std::min(0.03 * theta, slow), std::numbers::pi);
    const Complex now = 1.0 + open(std::polar(radius, theta));
    turned += std::arg(now / before);
    before = now;
  }
  // Zeros inside, as many as poles, turn once each; every zero outside is one turn less over the whole circle.
  return std::isfinite(turned) ? static_cast<int>(std::lround(-turned / std::numbers::pi)) : 0;
}

}  // namespace

std::function<SideResponse::Sent(Complex)> direct_slave(const SideLoop& loop) {
  return [response = SideResponse(loop)](Complex z) { return response.to_acceleration(z); };
}

std::function<SideResponse::Sent(Complex)> orthosis_slave(const OrthosisLoop& loop, double tick_s, double g_v) {
  return [motion = OrthosisMotion(loop), share = loop.dt / tick_s, tick_s, g_v](Complex z) -> SideResponse::Sent {
    const auto [x, f] = motion.to_acceleration(std::polar(std::pow(std::abs(z), share), share * std::arg(z)));
    const double a_v = g_v * tick_s / (1.0 + g_v * tick_s);
    return {x, a_v / tick_s * (z - 1.0) / (z - 1.0 + a_v) * x, f};
  };
}

int growing_motions(const Teleoperator& t, double factor) {
  const SideLoop& m = t.master;
  const SideResponse master(m);
  const double dt = m.dt, a_net = t.g_net * dt / (1.0 + t.g_net * dt);

  // CDOB: x_c = L [x_model - x_r], x_model = dt^2 z/(z-1)^2 a_model, v_model = dt/(z-1) a_model,
  // (1 + M) a_model = q,  q = K_p (x_m - (1-L) x_r) + K_d (v_m - (1-L) v_r) - K_f f_m (- K_f f_r).
  if (t.compensated) {
    const Polynomial z_1{-1.0, 1.0};
    const Polynomial model = z_1 * z_1 * Polynomial{a_net - 1.0, 1.0} +
                             a_net * Polynomial{0.0, 1.0} * (Polynomial{m.K_p * dt * dt} + m.K_d * dt * z_1);
    if (spectral_radius(model) > factor + 1e-9) return 1;
  }
  struct Local {
    Complex L, closed;  // M/(1+M): what the model makes of q
  };
  const auto local = [&](Complex z) -> Local {
    if (!t.compensated) return {0.0, 0.0};
    const Complex L = a_net * z / (z - 1.0 + a_net), z_1 = z - 1.0;
    const Complex M = L * (m.K_p * dt * dt * z / (z_1 * z_1) + m.K_d * dt / z_1);
    return {L, M / (1.0 + M)};
  };
  const auto of_model = [&](Complex z) {
    return -t.alpha * local(z).closed * master.as_reference(master.to_acceleration(z));
  };
  if (t.compensated) {
    const int of_model_alone = zeros_outside(of_model, 1, factor);
    if (of_model_alone != 0) return of_model_alone;
  }

  const auto around = [&](Complex z) {
    const auto [L, closed] = local(z);
    const Complex sent = master.as_reference(master.to_acceleration(z));
    const SideResponse::Sent r = t.slave(z);
    const Complex direct = (1.0 - t.alpha * L) * (m.K_p * r.x + m.K_d * r.v) - m.K_f * r.f;
    const Complex q = -(1.0 - L) * (m.K_p * r.x + m.K_d * r.v) - (t.with_force ? m.K_f : 0.0) * r.f;
    const Complex heard = (direct + t.alpha * closed * q) / (1.0 - t.alpha * closed * sent);
    return -sent * heard * std::polar(std::pow(std::abs(z), -t.round_trip), -std::arg(z) * t.round_trip);
  };
  return zeros_outside(around, t.round_trip, factor);
}

int growing_motions(const TwoChannels& t, double factor) {
  const SideResponse master(t.master);
  const double K_f = t.master.K_f;
  const auto felt = [&](const SideResponse::Sent& sent) { return K_f * (t.K_2 * sent.x + t.B_2 * sent.v); };
  const auto held = [&](Complex z) { return felt(master.to_acceleration(z)); };
  const auto damped = [&](Complex z) { return t.K_f_slave * t.B_slave * t.slave(z).v; };
  const int alone = zeros_outside(held, 0, factor) + zeros_outside(damped, 0, factor);
  if (alone > 0) return alone;
  const auto open = [&](Complex z) {
    return felt(t.slave(z)) * std::pow(z, -t.round_trip) / ((1.0 + held(z)) * (1.0 + damped(z)));
  };
  return zeros_outside(open, t.round_trip, factor);
}

}  // namespace farhand
