#include "netem/lab/extreme_bounce.hpp"

#include <algorithm>
#include <boost/numeric/odeint.hpp>  // whole: with its parts alone the controlled stepper creeps
#include <cmath>

namespace farhand::extreme {

using Long = long double;

Bounce::Bounce(double J, double D, std::vector<Contact> contacts, double x, double v)
    : J_(J), D_(D), x_(x), v_(v), contacts_(std::move(contacts)) {
  for (Contact& c : contacts_) c.pushing = changes(c, {x_, v_});
}

// J x'' + D x' + k x = u with the springs that push; about the equilibrium where there is one.
Bounce::Point Bounce::after(Long h) const {
  Long k = 0, D = D_, u = torque_;
  for (const Contact& c : contacts_) {
    if (!c.pushing) continue;
    k += c.k, D += c.b, u += c.k * c.at;
  }
  if (k == 0) {
    if (D == 0) return {x_ + h * (v_ + h * u / (2 * J_)), v_ + h * u / J_};
    const Long c = D / J_, terminal = u / D, gone = -std::expm1(-c * h);
    return {x_ + terminal * h + (v_ - terminal) * gone / c, v_ + (terminal - v_) * gone};
  }
  const Long rest = u / k, a = D / (2 * J_), w2 = k / J_ - a * a, y = x_ - rest;
  Long C, S;
  if (w2 > 0) {
    const Long w = std::sqrt(w2), e = std::exp(-a * h);
    C = e * std::cos(w * h), S = e * std::sin(w * h) / w;
  } else {
    // Both roots from their product, so that the slow one keeps its digits.
    const Long r = std::sqrt(-w2), fast = -a - r, slow = (k / J_) / fast;
    const Long p = std::exp(slow * h), m = std::exp(fast * h);
    C = (p + m) / 2, S = r > 0 ? (p - m) / (2 * r) : h * p;
  }
  return {rest + (C + a * S) * y + S * v_, -(k / J_) * S * y + (C - a * S) * v_};
}

bool Bounce::changes(const Contact& c, const Point& point) {
  const Long p = c.side * (point.x - c.at), push = c.k * p + c.b * c.side * point.v;
  return c.pushing ? push < 0 : p > 0 && push > 0;
}

int Bounce::first_change(const Point& point) const {
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    if (changes(contacts_[i], point)) return static_cast<int>(i);
  }
  return -1;
}

Long Bounce::look_ahead() const {
  Long k = 0, D = D_, nearest = 1;
  for (const Contact& c : contacts_) {
    nearest = std::min(nearest, std::fabs(x_ - c.at));
    if (c.pushing) k += c.k, D += c.b;
  }
  // In flight: a hundredth of the way, at this speed and under this torque.
  if (k == 0) return std::max(1e-7L, std::min(1e-4L, nearest / 100 / (std::fabs(v_) + 1e-3L)));
  // Pressed in: a fiftieth of the swing, or of the creep where it is overdamped.
  return D * D < 4 * k * J_ ? 0.02L / std::sqrt(k / J_) : std::min(1e-4L, 0.02L * D / k);
}

void Bounce::advance(double torque, double seconds) {
  torque_ = torque;
  Long left = seconds;
  while (left > 0) {
    Long h = std::min(left, look_ahead());
    Point point = after(h);
    int contact = first_change(point);
    if (contact >= 0) {
      Long low = 0, high = h;
      for (int i = 0; i < 90; ++i) {
        const Long middle = (low + high) / 2;
        const int there = first_change(after(middle));
        (there >= 0 ? high : low) = middle;
        if (there >= 0) contact = there;
      }
      h = high;
      point = after(h);
    }
    x_ = point.x, v_ = point.v;
    left -= h;
    if (contact >= 0) {
      contacts_[static_cast<std::size_t>(contact)].pushing ^= true;
      ++events_;
    }
  }
}

MotorAxis::Params motor_of(const LuGrePlan& plan) {
  return {.J = plan.J,
          .viscous = 0,
          .encoder_counts_per_rev = 0,
          .stop_min = -7,
          .stop_max = 7,
          .bristle = Bristle::Params{.F_c = plan.F_c,
                                     .F_s = plan.F_s,
                                     .v_s = plan.v_s,
                                     .sigma_0 = plan.sigma_0,
                                     .sigma_1 = plan.sigma_1,
                                     .sigma_2 = plan.sigma_2}};
}

std::vector<std::array<double, 3>> lugre_reference(const LuGrePlan& plan) {
  namespace odeint = boost::numeric::odeint;
  using State = std::vector<Long>;
  const Long J = plan.J, s0 = plan.sigma_0, s1 = plan.sigma_1, s2 = plan.sigma_2, F_c = plan.F_c, F_s = plan.F_s,
             v_s = plan.v_s;
  State y(3);
  std::vector<std::array<double, 3>> all;
  using Stepper = odeint::runge_kutta_fehlberg78<State, Long, State, Long>;
  const auto stepper = odeint::make_controlled<Stepper>(1e-16L, 1e-15L);
  for (const double torque : plan.torques) {
    const auto slope = [&](const State& x, State& dx, Long) {
      const Long v = x[1], z = x[2];  // z: the bristle's deflection
      const Long g = F_c + (F_s - F_c) * std::exp(-(v / v_s) * (v / v_s));
      const Long dz = v - s0 * std::fabs(v) * z / g;
      dx[0] = v;
      dx[1] = (static_cast<Long>(torque) - (s0 * z + s1 * dz + s2 * v)) / J;
      dx[2] = dz;
    };
    odeint::integrate_adaptive(stepper, slope, y, Long(0), static_cast<Long>(plan.seconds), Long(1e-7L));
    all.push_back({static_cast<double>(y[0]), static_cast<double>(y[1]), static_cast<double>(s0 * y[2])});
  }
  return all;
}

}  // namespace farhand::extreme
