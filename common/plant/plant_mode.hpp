// Use of the bits of a mode by the plants of this room, and ranges without borders.
#pragma once

#include <limits>

#include "common/integrate/plant.hpp"

namespace farhand {

constexpr Mode kAtStopMin = 1u << 0;
constexpr Mode kAtStopMax = 1u << 1;
constexpr Mode kAtWall = 1u << 2;
constexpr Mode kHandPresent = 1u << 3;
constexpr Mode kSlidesBack = 1u << 4;  // friction takes the velocity as negative
constexpr Mode kSticking = 1u << 5;
constexpr Mode kSpringAtMin = 1u << 6;
constexpr Mode kSpringAtMax = 1u << 7;
constexpr Mode kTouching = kAtStopMin | kAtStopMax | kAtWall;
constexpr Mode kStretchedUp = 1u << 8;  // a spastic hand, fast away from its rest angle
constexpr Mode kStretchedDown = 1u << 9;
constexpr Mode kStretched = kStretchedUp | kStretchedDown;
constexpr int kPieceShift = 10;  // above: the piece of the intended motion

// Angles without contact, rad.
struct FreeRange {
  double low = -std::numeric_limits<double>::infinity(), high = std::numeric_limits<double>::infinity();
};

constexpr double kNoGuard = 1.0;  // of a border that cannot be reached

constexpr double direction(Mode mode) noexcept { return (mode & kSlidesBack) != 0 ? -1.0 : 1.0; }

}  // namespace farhand
