// The angle at which the therapist intends the hand to be: one movement after the other, each in closed form; then the
// last position is held.
#pragma once

#include <array>
#include <numbers>
#include <vector>

#include "common/integrate/affine.hpp"

namespace farhand {

struct Movement {
  enum class Kind { kHold, kRamp, kSine };
  Kind kind = Kind::kHold;
  double duration = 0;   // s, positive
  double to = 0;         // kRamp: rad, by a minimum-jerk profile: at rest and without acceleration at both ends
  double amplitude = 0;  // kSine: rad, around the end of the last movement
  double frequency = 0;  // kSine: Hz

  static Movement hold(double duration) { return {Kind::kHold, duration, 0, 0, 0}; }
  static Movement ramp(double to, double duration) { return {Kind::kRamp, duration, to, 0, 0}; }
  static Movement sine(double amplitude, double frequency, double duration) {
    return {Kind::kSine, duration, 0, amplitude, frequency};
  }
  double omega() const noexcept { return 2.0 * std::numbers::pi * frequency; }
};

class IntendedMotion {
 public:
  struct Point {
    double x = 0, v = 0, a = 0;
  };

  // Starts at 0 s, at the angle `start`.
  explicit IntendedMotion(const std::vector<Movement>& movements, double start = 0);

  // The pieces are counted: 0 is the rest before 0 s, the last is the rest after the end. A piece is smooth, also
  // beyond its ends.
  std::size_t piece_at(double t) const noexcept;
  // Time at which the next piece begins, after t; +inf if there is none.
  double next_break(double t) const noexcept;
  Point at(std::size_t piece, double t) const noexcept;

  // Before 0 s: the start. The position is continuous. So is the velocity, except where a sine begins or ends in
  // mid-swing: there it jumps, and the arm's damper reacts to the jump.
  Point at(double t) const noexcept { return at(piece_at(t), t); }
  double end() const noexcept { return pieces_.back().begin; }

  // K x + B v over the piece that holds at t.
  template <class T>
  Forcing<T> forcing(double t, double K, double B) const noexcept {
    const Piece& piece = pieces_[piece_at(t)];
    const Movement& m = piece.movement;
    Forcing<T> r;
    r.begin = T(piece.begin);
    r.polynomial[0] = T(K) * T(piece.from);
    if (m.kind == Movement::Kind::kRamp) {
      const T D = T(m.duration), cubic = (T(m.to) - T(piece.from)) / (D * D * D);
      const std::array<T, 6> x{0, 0, 0, T(10) * cubic, T(-15) * cubic / D, T(6) * cubic / (D * D)};
      for (std::size_t j = 2; j < 6; ++j) {
        r.polynomial[j] += T(K) * x[j] + (j < 5 ? T(B) * static_cast<T>(j + 1) * x[j + 1] : T(0));
      }
    } else if (m.kind == Movement::Kind::kSine) {
      r.omega = T(m.omega());
      r.sine = T(K) * T(m.amplitude);
      r.cosine = T(B) * T(m.amplitude) * r.omega;
    }
    return r;
  }

 private:
  struct Piece {
    Movement movement;
    double begin;  // s
    double from;   // rad
  };
  static Point within(const Piece& piece, double s) noexcept;  // s: time since the piece began

  std::vector<Piece> pieces_;
};

}  // namespace farhand
