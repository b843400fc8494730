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

}  // namespace farhand::toy
