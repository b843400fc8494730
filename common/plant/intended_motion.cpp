#include "common/plant/intended_motion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace farhand {

IntendedMotion::IntendedMotion(const std::vector<Movement>& movements, double start) {
  pieces_.reserve(movements.size() + 2);
  pieces_.push_back({Movement::hold(0), 0.0, start});
  double begin = 0, from = start;
  for (const Movement& movement : movements) {
    pieces_.push_back({movement, begin, from});
    from = within(pieces_.back(), movement.duration).x;
    begin += movement.duration;
  }
  if (!movements.empty()) pieces_.push_back({Movement::hold(0), begin, from});
}

std::size_t IntendedMotion::piece_at(double t) const noexcept {
  const auto next = std::upper_bound(pieces_.begin() + 1, pieces_.end(), t,
                                     [](double time, const Piece& piece) { return time < piece.begin; });
  return static_cast<std::size_t>(next - pieces_.begin()) - 1;
}

double IntendedMotion::next_break(double t) const noexcept {
  const std::size_t next = piece_at(t) + 1;
  return next < pieces_.size() ? pieces_[next].begin : std::numeric_limits<double>::infinity();
}

IntendedMotion::Point IntendedMotion::at(std::size_t piece, double t) const noexcept {
  return within(pieces_[piece], t - pieces_[piece].begin);
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
      const double w = m.omega();
      const double swing = m.amplitude * std::sin(w * s);
      return {piece.from + swing, m.amplitude * w * std::cos(w * s), -w * w * swing};
    }
    case Movement::Kind::kHold:
      break;
  }
  return {piece.from, 0, 0};
}

}  // namespace farhand
