#include "netem/lab/rogue_release.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace farhand::rogue {
namespace {

constexpr double kStep = 0.25e-3;  // s, the fastest body turns with 90 rad/s, its motor follows with 190 1/s
constexpr double kWatched = 0.4;   // s, more than a swing of the slowest body

BodyState rate(const Body& b, const BodyState& s) noexcept {
  const double tau = b.spring > 0 ? b.spring * (s.motor_x - s.x) : 0.0;
  const double shown = b.spring * (s.motor_x - s.x_shown), v = b.followed(s);
  const double wanted = std::clamp(v - b.spring_gain * shown, -b.motor_limit, b.motor_limit);
  const double a = (tau - b.viscous * s.v - b.reaction(s.x, s.v)) / b.J;
  return {.x = s.v,
          .v = a,
          .motor_x = s.motor_v,
          .motor_v = 2 * std::numbers::pi * b.motor_hz * (wanted - s.motor_v),
          .x_shown = frozen(b.frozen_from_s, s.t_s) ? 0 : s.v,
          .x_slow = v,
          .t_s = 1};
}

BodyState moved(const BodyState& s, const BodyState& d, double h) noexcept {
  return {s.x + h * d.x,
          s.v + h * d.v,
          s.motor_x + h * d.motor_x,
          s.motor_v + h * d.motor_v,
          s.x_shown + h * d.x_shown,
          s.x_slow + h * d.x_slow,
          s.t_s + h * d.t_s};
}

}  // namespace

double Body::reaction(double x, double v) const noexcept {
  const bool stretched = x * v > 0 && std::fabs(v) > spastic_above;
  return K * x + B * v + (stretched ? spastic * (std::fabs(v) - spastic_above) * (v > 0 ? 1 : -1) : 0.0);
}

double Body::followed(const BodyState& s) const noexcept {
  return velocity_cutoff > 0 ? std::clamp(velocity_cutoff * (s.x_shown - s.x_slow), -fastest, fastest) : s.v;
}

LetGo let_go(const Body& body, BodyState s) noexcept {
  LetGo most;
  for (double t = 0; t < kWatched; t += kStep) {
    if (!frozen(body.frozen_from_s, s.t_s)) s.x_shown = s.x;
    if (body.velocity_cutoff > 0) s.x_slow = s.x_shown - body.followed(s) / body.velocity_cutoff;
    const BodyState a = rate(body, s), b = rate(body, moved(s, a, kStep / 2)), c = rate(body, moved(s, b, kStep / 2)),
                    d = rate(body, moved(s, c, kStep));
    const double torque = body.reaction(s.x, s.v) + body.J_person * a.v;
    most.speed = std::max(most.speed, std::fabs(s.v));
    most.power = std::max(most.power, torque * s.v);
    const auto mean = [](double p, double q, double r, double u) { return (p + 2 * q + 2 * r + u) / 6; };
    s = moved(s,
              {mean(a.x, b.x, c.x, d.x), mean(a.v, b.v, c.v, d.v), mean(a.motor_x, b.motor_x, c.motor_x, d.motor_x),
               mean(a.motor_v, b.motor_v, c.motor_v, d.motor_v), mean(a.x_shown, b.x_shown, c.x_shown, d.x_shown),
               mean(a.x_slow, b.x_slow, c.x_slow, d.x_slow), 1},
              kStep);
    if (std::fabs(s.x) > body.stop) {
      s.x = std::copysign(body.stop, s.x);
      s.v = 0;
    }
  }
  return most;
}

}  // namespace farhand::rogue
