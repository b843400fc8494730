// What is known of the friction of a device: the part of its reaction that is there without a hand. A sweep without a
// hand measures it (common/station/sweeping.hpp).
#pragma once

namespace farhand {

struct KnownFriction {
  // N m: a reaction below it may come without a hand. The default is cautious: tendons in good order have less.
  double threshold = 0.1;
  bool known = false;  // measured by a sweep not older than a day
};

}  // namespace farhand
