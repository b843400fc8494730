// Sources and losses of the energy of a world, for its balance: d(stored)/dt = supplied - dissipated.
#pragma once

namespace farhand {

struct PowerFlow {
  double supplied = 0;    // W, by the drive and by the therapist's intention; either sign
  double dissipated = 0;  // W, never negative
};

}  // namespace farhand
