// Small plants with known solutions, for the tests of the integrators.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

#include "common/integrate/plant.hpp"

namespace farhand::toy {

constexpr double kNever = std::numeric_limits<double>::infinity();

// A plant without modes, guards and breaks.
template <std::size_t kN>
struct Smooth {
  static constexpr std::size_t kStates = kN, kGuards = 0;
  using State = std::array<double, kN>;
  Mode mode_at(double, const State&) const noexcept { return 0; }
  std::array<double, 0> guards(Mode, double, const State&) const noexcept { return {}; }
  Mode cross(Mode mode, std::size_t, double, State&) const noexcept { return mode; }
  double next_break(double) const noexcept { return kNever; }
  State time_derivative(Mode, double, const State&) const noexcept { return {}; }
};

// x' = A x
template <std::size_t kN>
struct Linear : Smooth<kN> {
  using typename Smooth<kN>::State;
  StateMatrix<kN> A;
  explicit Linear(const StateMatrix<kN>& a) : A(a) {}
  State derivative(Mode, double, const State& x) const noexcept {
    State y{};
    for (std::size_t i = 0; i < kN; ++i)
      for (std::size_t j = 0; j < kN; ++j) y[i] += A[i][j] * x[j];
    return y;
  }
  StateMatrix<kN> jacobian(Mode, double, const State&) const noexcept { return A; }
};

// Driven away from its own frequency, from rest.
struct Driven : Smooth<2> {
  State derivative(Mode, double t, const State& x) const noexcept { return {x[1], -9.0 * x[0] + std::sin(2.0 * t)}; }
  StateMatrix<2> jacobian(Mode, double, const State&) const noexcept { return {{{0.0, 1.0}, {-9.0, 0.0}}}; }
  State time_derivative(Mode, double t, const State&) const noexcept { return {0.0, 2.0 * std::cos(2.0 * t)}; }
  static State exact(double t) {
    return {(std::sin(2.0 * t) - 2.0 / 3.0 * std::sin(3.0 * t)) / 5.0,
            (2.0 * std::cos(2.0 * t) - 2.0 * std::cos(3.0 * t)) / 5.0};
  }
};

// y' = -y^2 cos t, y(0) = 1: the Jacobian depends on state and time.
struct Nonlinear : Smooth<1> {
  State derivative(Mode, double t, const State& y) const noexcept { return {-y[0] * y[0] * std::cos(t)}; }
  StateMatrix<1> jacobian(Mode, double t, const State& y) const noexcept { return {{{-2.0 * y[0] * std::cos(t)}}}; }
  State time_derivative(Mode, double t, const State& y) const noexcept { return {y[0] * y[0] * std::sin(t)}; }
  static State exact(double t) { return {1.0 / (1.0 + std::sin(t))}; }
};

// A mass under weight over a floor at 0 that pushes with k p + b p', p = -x, and never pulls.
struct Bouncer {
  static constexpr std::size_t kStates = 2, kGuards = 1;
  using State = std::array<double, 2>;
  static constexpr double kGravity = 9.81;
  double k, b;  // per mass

  enum : Mode { kOpen, kPushing };
  double push(const State& x) const noexcept { return -k * x[0] - b * x[1]; }
  Mode mode_at(double, const State& x) const noexcept {
    return x[0] <= 0 && push(x) >= 0 && x[1] < 0 ? kPushing : kOpen;
  }
  State derivative(Mode mode, double, const State& x) const noexcept {
    return {x[1], -kGravity + (mode == kPushing ? push(x) : 0.0)};
  }
  StateMatrix<2> jacobian(Mode mode, double, const State&) const noexcept {
    return mode == kPushing ? StateMatrix<2>{{{0.0, 1.0}, {-k, -b}}} : StateMatrix<2>{{{0.0, 1.0}, {0.0, 0.0}}};
  }
  State time_derivative(Mode, double, const State&) const noexcept { return {}; }
  std::array<double, 1> guards(Mode mode, double, const State& x) const noexcept {
    return {mode == kPushing ? push(x) : -std::fmin(-x[0], push(x))};
  }
  Mode cross(Mode mode, std::size_t, double, State&) const noexcept { return mode == kPushing ? kOpen : kPushing; }
  double next_break(double) const noexcept { return kNever; }

  // Dropped at rest from x0 > 0. The damping ratio must be below 1.
  State exact(double x0, double t) const {
    using Long = long double;
    const Long K = k, B = b, g = kGravity;
    const Long delta = B / 2, omega = std::sqrt(K - delta * delta), rest = -g / K;
    Long x = x0, v = 0, left = t;
    for (;;) {
      const Long fall = (v + std::sqrt(v * v + 2 * g * x)) / g;
      if (fall >= left) return {double(x + v * left - g * left * left / 2), double(v - g * left)};
      left -= fall;
      v -= g * fall;
      // x = rest + e^(-delta s) (c cos + d sin)
      const Long c = -rest, d = (v + delta * c) / omega;
      const auto position = [&](Long s) {
        return rest + std::exp(-delta * s) * (c * std::cos(omega * s) + d * std::sin(omega * s));
      };
      const auto velocity = [&](Long s) {
        return std::exp(-delta * s) *
               ((omega * d - delta * c) * std::cos(omega * s) - (omega * c + delta * d) * std::sin(omega * s));
      };
      const auto force = [&](Long s) { return -K * position(s) - B * velocity(s); };
      Long low = 0.01L / omega, high = low;
      while (force(high) > 0) low = high, high += 0.01L / omega;
      for (int i = 0; i < 80; ++i) {
        const Long middle = (low + high) / 2;
        (force(middle) > 0 ? low : high) = middle;
      }
      if (high >= left) return {double(position(left)), double(velocity(left))};
      left -= high;
      x = position(high);
      v = velocity(high);
    }
  }
};

// A mass on a spring (omega 1) that a belt of speed 1 drags along: it sticks to the belt up to `hold`, slips at
// `slide`.
struct StickSlip {
  static constexpr std::size_t kStates = 2, kGuards = 1;
  using State = std::array<double, 2>;
  double hold = 2.0, slide = 1.0;

  enum : Mode { kStick, kSlip };
  Mode mode_at(double, const State& x) const noexcept { return x[1] >= 1.0 && x[0] <= hold ? kStick : kSlip; }
  State derivative(Mode mode, double, const State& x) const noexcept {
    return {x[1], mode == kStick ? 0.0 : slide - x[0]};
  }
  StateMatrix<2> jacobian(Mode mode, double, const State&) const noexcept {
    return {{{0.0, 1.0}, {mode == kStick ? 0.0 : -1.0, 0.0}}};
  }
  State time_derivative(Mode, double, const State&) const noexcept { return {}; }
  std::array<double, 1> guards(Mode mode, double, const State& x) const noexcept {
    return {mode == kStick ? hold - x[0] : 1.0 - x[1]};
  }
  Mode cross(Mode mode, std::size_t, double, State& x) const noexcept {
    x[1] = 1.0;
    return mode == kStick ? kSlip : kStick;
  }
  double next_break(double) const noexcept { return kNever; }

  // From x = 0 on the belt. Slip: x - slide = a cos s + sin s with a = hold - slide, until v = 1 again, where x - slide
  // = -a.
  State exact(double t) const {
    const double a = hold - slide, amplitude = std::hypot(a, 1.0), phase = std::atan2(1.0, a);
    const double slip = std::numbers::pi + 2.0 * phase;
    double stick = hold;
    for (;;) {
      if (t <= stick) return {hold - stick + t, 1.0};
      t -= stick;
      if (t <= slip) return {slide + amplitude * std::cos(t - phase), -amplitude * std::sin(t - phase)};
      t -= slip;
      stick = 2.0 * a;
    }
  }
};

// A mass under constant acceleration and two one-sided springs that resist motion above `at`: a ceiling of two layers.
struct Ceiling {
  static constexpr std::size_t kStates = 2, kGuards = 2;
  using State = std::array<double, 2>;
  std::array<double, 2> at, k;
  double b = 0, acceleration = -9.81;

  double push(std::size_t i, const State& x) const noexcept { return k[i] * (x[0] - at[i]) + b * x[1]; }
  static bool pushing(Mode mode, std::size_t i) noexcept { return (mode >> i & 1u) != 0; }
  Mode mode_at(double, const State& x) const noexcept {
    Mode mode = 0;
    for (std::size_t i = 0; i < 2; ++i)
      if (x[0] >= at[i] && push(i, x) > 0) mode |= 1u << i;
    return mode;
  }
  State derivative(Mode mode, double, const State& x) const noexcept {
    double a = acceleration;
    for (std::size_t i = 0; i < 2; ++i)
      if (pushing(mode, i)) a -= push(i, x);
    return {x[1], a};
  }
  StateMatrix<2> jacobian(Mode mode, double, const State&) const noexcept {
    StateMatrix<2> J{{{0.0, 1.0}, {0.0, 0.0}}};
    for (std::size_t i = 0; i < 2; ++i)
      if (pushing(mode, i)) J[1][0] -= k[i], J[1][1] -= b;
    return J;
  }
  State time_derivative(Mode, double, const State&) const noexcept { return {}; }
  std::array<double, 2> guards(Mode mode, double, const State& x) const noexcept {
    std::array<double, 2> g;
    for (std::size_t i = 0; i < 2; ++i) g[i] = pushing(mode, i) ? push(i, x) : -std::fmin(x[0] - at[i], push(i, x));
    return g;
  }
  Mode cross(Mode mode, std::size_t guard, double, State&) const noexcept { return mode ^ 1u << guard; }
  double next_break(double) const noexcept { return kNever; }
};

// A ball that keeps `restitution` of its speed at each touch of the floor: infinitely many in finite time.
struct Ball {
  static constexpr std::size_t kStates = 2, kGuards = 1;
  using State = std::array<double, 2>;
  double restitution = 0.5, gravity = 9.81;

  Mode mode_at(double, const State&) const noexcept { return 0; }
  State derivative(Mode, double, const State& x) const noexcept { return {x[1], -gravity}; }
  StateMatrix<2> jacobian(Mode, double, const State&) const noexcept { return {{{0.0, 1.0}, {0.0, 0.0}}}; }
  State time_derivative(Mode, double, const State&) const noexcept { return {}; }
  std::array<double, 1> guards(Mode, double, const State& x) const noexcept { return {x[0]}; }
  Mode cross(Mode mode, std::size_t, double, State& x) const noexcept {
    x = {0.0, -restitution * x[1]};
    return mode;
  }
  double next_break(double) const noexcept { return kNever; }
};

// A block of mass 1 under a held force and dry friction, which sticks unless it is told never to.
struct Block {
  static constexpr std::size_t kStates = 2, kGuards = 1;
  using State = std::array<double, 2>;
  double friction = 1.0;
  bool sticks = true;
  double force = 0.0;

  enum : Mode { kStick, kForward, kBackward };
  void hold(double input) noexcept { force = input; }
  Mode direction(double along) const noexcept { return along < 0 ? kBackward : kForward; }
  Mode mode_at(double, const State& x) const noexcept {
    if (x[1] != 0) return direction(x[1]);
    return sticks && std::fabs(force) <= friction ? kStick : direction(force);
  }
  State derivative(Mode mode, double, const State& x) const noexcept {
    if (mode == kStick) return {};
    return {x[1], force - (mode == kForward ? friction : -friction)};
  }
  StateMatrix<2> jacobian(Mode mode, double, const State&) const noexcept {
    return {{{0.0, mode == kStick ? 0.0 : 1.0}, {0.0, 0.0}}};
  }
  State time_derivative(Mode, double, const State&) const noexcept { return {}; }
  std::array<double, 1> guards(Mode mode, double, const State& x) const noexcept {
    return {mode == kStick ? friction - std::fabs(force) : mode == kForward ? x[1] : -x[1]};
  }
  Mode cross(Mode mode, std::size_t, double, State& x) const noexcept {
    if (!sticks) return mode == kForward ? kBackward : kForward;
    const bool stuck = mode == kStick;
    x[1] = 0.0;
    return !stuck && std::fabs(force) <= friction ? kStick : direction(force);
  }
  double next_break(double) const noexcept { return kNever; }
};

// The driven oscillator, whose drive is cut off at once.
struct CutOff : Driven {
  double end;
  explicit CutOff(double t) : end(t) {}
  State derivative(Mode mode, double t, const State& x) const noexcept {
    return t < end ? Driven::derivative(mode, t, x) : State{x[1], -9.0 * x[0]};
  }
  State time_derivative(Mode mode, double t, const State& x) const noexcept {
    return t < end ? Driven::time_derivative(mode, t, x) : State{};
  }
  double next_break(double t) const noexcept { return t < end ? end : kNever; }
  State exact_after(double t) const {
    const State at_end = exact(end);
    const double c = std::cos(3.0 * (t - end)), s = std::sin(3.0 * (t - end));
    return {at_end[0] * c + at_end[1] / 3.0 * s, at_end[1] * c - 3.0 * at_end[0] * s};
  }
};

// A mass on a bristle (LuGre), pulled to and fro: F = s0 z + s1 z' + s2 v, z' = v - s0 |v| z / g(v). The modes are the
// signs of v; changing over a little late spares needless events.
struct LuGre {
  static constexpr std::size_t kStates = 3, kGuards = 1;  // x, v, s0 z
  using State = std::array<double, 3>;
  double s0, s1, s2 = 0.01, mass = 4e-3, coulomb = 0.05, stiction = 0.08, stribeck = 0.05, pull = 0.2, omega = 6.0;

  enum : Mode { kForward, kBackward };
  static double sign(Mode mode) noexcept { return mode == kForward ? 1.0 : -1.0; }
  double level(double v) const noexcept {
    return coulomb + (stiction - coulomb) * std::exp(-v * v / (stribeck * stribeck));
  }
  double level_slope(double v) const noexcept { return -2.0 * v / (stribeck * stribeck) * (level(v) - coulomb); }
  double rate(Mode mode, const State& x) const noexcept { return x[1] - sign(mode) * x[1] * x[2] / level(x[1]); }
  Mode mode_at(double, const State& x) const noexcept { return x[1] < 0 ? kBackward : kForward; }
  State derivative(Mode mode, double t, const State& x) const noexcept {
    const double z = rate(mode, x);
    return {x[1], (pull * std::sin(omega * t) - x[2] - s1 * z - s2 * x[1]) / mass, s0 * z};
  }
  StateMatrix<3> jacobian(Mode mode, double, const State& x) const noexcept {
    const double g = level(x[1]), by_force = -sign(mode) * x[1] / g;
    const double by_v = 1.0 - sign(mode) * x[2] / g * (1.0 - x[1] * level_slope(x[1]) / g);
    return {{{0.0, 1.0, 0.0},
             {0.0, -(s1 * by_v + s2) / mass, -(1.0 + s1 * by_force) / mass},
             {0.0, s0 * by_v, s0 * by_force}}};
  }
  State time_derivative(Mode, double t, const State&) const noexcept {
    return {0.0, pull * omega * std::cos(omega * t) / mass, 0.0};
  }
  std::array<double, 1> guards(Mode mode, double, const State& x) const noexcept { return {sign(mode) * x[1] + 1e-9}; }
  Mode cross(Mode mode, std::size_t, double, State&) const noexcept { return mode == kForward ? kBackward : kForward; }
  double next_break(double) const noexcept { return kNever; }
};

}  // namespace farhand::toy
