// A mass between one-sided springs, drawn by a spring and damper towards a moving target: the smallest plant that has
// all that a piecewise affine one can have.
#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "common/integrate/affine.hpp"

namespace farhand {

struct ToyContact {
  double k = 1000, b = 0.4, at = 0.1, side = 1;
};

// J v' = input - viscous v - k x - contacts + arm (r - x);   r: pieces of movement, each until the next begins
struct ToyPlant {
  static constexpr std::size_t kStates = 2, kGuards = 3;
  static constexpr bool kInputMovesGuards = false;
  using State = std::array<double, 2>;

  double J = 0.004, viscous = 0.002, k = 0, arm = 0;
  std::vector<ToyContact> contacts = {};     // at most kGuards
  std::vector<Forcing<double>> motion = {};  // by time
  double input = 0;

  void hold(double torque) { input = torque; }
  double held() const noexcept { return input; }
  template <class T>
  std::array<T, 2> held_gain(Mode) const noexcept {
    return {T(0), T(1) / T(J)};
  }
  const char* not_affine() const noexcept { return nullptr; }

  template <class T>
  AffineFlow<T, 2> flow(Mode mode) const noexcept {
    T stiffness = T(k) + T(arm), damping = T(viscous), torque = T(input);
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      if ((mode >> i & 1) == 0) continue;
      stiffness += T(contacts[i].k), damping += T(contacts[i].b), torque += T(contacts[i].k) * T(contacts[i].at);
    }
    return {{{{T(0), T(1)}, {-stiffness / T(J), -damping / T(J)}}}, {T(0), torque / T(J)}, {T(0), T(arm) / T(J)}};
  }
  template <class T>
  Forcing<T> forcing(double t) const noexcept {
    Forcing<T> out;
    for (const auto& piece : motion) {
      if (&piece != motion.data() && t < piece.begin) break;
      out.begin = T(piece.begin), out.omega = T(piece.omega), out.sine = T(piece.sine), out.cosine = T(piece.cosine);
      for (std::size_t j = 0; j < 6; ++j) out.polynomial[j] = T(piece.polynomial[j]);
    }
    return out;
  }
  template <class T>
  std::array<AffineGuard<T, 2>, kGuards> guard_forms(Mode mode) const noexcept {
    using Guard = AffineGuard<T, 2>;
    std::array<Guard, kGuards> all{};
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      const ToyContact& c = contacts[i];
      const AffineForm<T, 2> push{{T(c.k) * T(c.side), T(c.b) * T(c.side)}, -T(c.k) * T(c.side) * T(c.at), 0};
      if ((mode >> i & 1) != 0) {
        all[i] = {Guard::Kind::kOne, push, {}};
      } else {
        all[i] = {
            Guard::Kind::kMax, {{-T(c.side), T(0)}, T(c.side) * T(c.at), 0}, {{-push.c[0], -push.c[1]}, -push.d, 0}};
      }
    }
    return all;
  }

  Mode mode_at(double, const State& x) const noexcept {
    Mode mode = 0;
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      const ToyContact& c = contacts[i];
      const double p = c.side * (x[0] - c.at);
      if (p > 0 && c.k * p + c.b * c.side * x[1] > 0) mode |= 1u << i;
    }
    return mode;
  }
  State derivative(Mode mode, double t, const State& x) const noexcept {
    const auto f = flow<double>(mode);
    return {x[1], f.A[1][0] * x[0] + f.A[1][1] * x[1] + f.b[1] + f.e[1] * forcing<double>(t).at(t)};
  }
  StateMatrix<2> jacobian(Mode mode, double, const State&) const noexcept { return flow<double>(mode).A; }
  State time_derivative(Mode, double, const State&) const noexcept { return {}; }
  std::array<double, kGuards> guards(Mode mode, double t, const State& x) const noexcept {
    const auto forms = guard_forms<double>(mode);
    const double r = forcing<double>(t).at(t);
    return {forms[0].value(x, r), forms[1].value(x, r), forms[2].value(x, r)};
  }
  Mode cross(Mode mode, std::size_t guard, double, State&) const noexcept { return mode ^ (1u << guard); }
  double next_break(double t) const noexcept {
    for (const auto& piece : motion) {
      if (piece.begin > t) return piece.begin;
    }
    return std::numeric_limits<double>::infinity();
  }
};

}  // namespace farhand
