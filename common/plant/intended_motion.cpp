#include "common/plant/intended_motion.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace farhand {

IntendedMotion::IntendedMotion(const std::vector<Movement>& movements, double start) : start_(start), last_(start) {
  pieces_.reserve(movements.size());
  double begin = 0;
  for (const Movement& movement : movements) {
    const Piece piece{movement, begin, last_};
    last_ = within(piece, movement.duration).x;
    begin += movement.duration;
    pieces_.push_back(piece);
  }
}

IntendedMotion::Point IntendedMotion::at(double t) const noexcept {
  if (pieces_.empty() || t < 0) return {start_, 0, 0};
  if (t >= end()) return {last_, 0, 0};
  const auto next = std::upper_bound(pieces_.begin(), pieces_.end(), t,
                                     [](double time, const Piece& piece) { return time < piece.begin; });
  const Piece& piece = *(next - 1);
  return within(piece, t - piece.begin);
}

IntendedMotion::Point IntendedMotion::within(const Piece& piece, double s) noexcept {
  const Movement& m = piece.movement;
  switch (m.kind) {
    case Movement::Kind::kRamp: {
      const double T = m.duration, r = s / T, d = m.to - piece.from;
      const double q = r * (1.0 - r);
      return {piece.from + d * r * r * r * (10.0 - 15.0 * r + 6.0 * r * r), 30.0 * d / T * q * q,
              60.0 * d / (T * T) * q * (1.0 - 2.0 * r)};
    }
    case Movement::Kind::kSine: {
      const double w = 2.0 * std::numbers::pi * m.frequency;
      const double swing = m.amplitude * std::sin(w * s);
      return {piece.from + swing, m.amplitude * w * std::cos(w * s), -w * w * swing};
    }
    case Movement::Kind::kHold:
      break;
  }
  return {piece.from, 0, 0};
}

}  // namespace farhand
