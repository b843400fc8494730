// The behaviour of a drive after its commands cease: it holds the last torque, then lets it fall to zero. A program
// that has stopped cannot reduce a torque; therefore this is a contract of the drive itself, and the station relies on
// it.
#pragma once

#include <algorithm>
#include <cmath>

namespace farhand {

struct TorqueHold {
  double hold_s = 0.0;  // time after a command before the torque falls
  double fall_s = 0.0;  // duration of the linear fall to zero

  // Share of the commanded torque that is left since_s after the command.
  double share(double since_s) const noexcept {
    if (since_s <= hold_s) return 1.0;
    return since_s < over_s() ? 1.0 - (since_s - hold_s) / fall_s : 0.0;
  }
  double over_s() const noexcept { return hold_s + fall_s; }
};

}  // namespace farhand
