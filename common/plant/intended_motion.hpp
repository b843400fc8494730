// Where the therapist's brain wants the hand to be: one movement after the other, each in closed form, then the last
// position is held.
#pragma once

#include <vector>

namespace farhand {

struct Movement {
  enum class Kind { kHold, kRamp, kSine };
  Kind kind = Kind::kHold;
  double duration = 0;   // s, positive
  double to = 0;         // kRamp: rad, by a minimum-jerk profile: at rest and without acceleration at both ends
  double amplitude = 0;  // kSine: rad, around where the last movement ended
  double frequency = 0;  // kSine: Hz

  static Movement hold(double duration) { return {Kind::kHold, duration, 0, 0, 0}; }
  static Movement ramp(double to, double duration) { return {Kind::kRamp, duration, to, 0, 0}; }
  static Movement sine(double amplitude, double frequency, double duration) {
    return {Kind::kSine, duration, 0, amplitude, frequency};
  }
};

class IntendedMotion {
 public:
  struct Point {
    double x = 0, v = 0, a = 0;
  };

  // Starts at 0 s, at the angle `start`.
  explicit IntendedMotion(const std::vector<Movement>& movements, double start = 0);

  // Before 0 s: the start. The position is continuous. The velocity is too, except where a sine begins, or ends in
  // mid-swing: it takes up its full velocity at once, and the arm's damper is what feels it.
  Point at(double t) const noexcept;
  double end() const noexcept {
    return pieces_.empty() ? 0.0 : pieces_.back().begin + pieces_.back().movement.duration;
  }

 private:
  struct Piece {
    Movement movement;
    double begin;  // s
    double from;   // rad
  };
  static Point within(const Piece& piece, double s) noexcept;  // s: time since the piece began

  std::vector<Piece> pieces_;
  double start_, last_;
};

}  // namespace farhand
