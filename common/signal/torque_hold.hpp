// What a drive does by itself where commands cease: it holds the last torque, then lets it fall to zero. A program that
// stands still decays nothing, so this is the drive's own contract; the station knows it and counts on it.
#pragma once

#include <algorithm>
#include <cmath>

namespace farhand {

struct TorqueHold {
  double hold_s = 0.0;  // after a command, before the fall
  double fall_s = 0.0;  // from all of it to nothing, straight

  // Of the commanded torque, so long after the command.
  double share(double since_s) const noexcept {
    if (since_s <= hold_s) return 1.0;
    return since_s < over_s() ? 1.0 - (since_s - hold_s) / fall_s : 0.0;
  }
  double over_s() const noexcept { return hold_s + fall_s; }
};

}  // namespace farhand
