// What happened within a tick, for recordings and the status line.
#pragma once

#include <limits>

#include "common/control/chooser.hpp"
#include "common/identify/misfit.hpp"
#include "common/scene/states.hpp"

namespace farhand {

// What a scene added to the received position.
struct Compensation {
  double x_cdob = 0.0;
  double alpha = 1.0;
  double f_2 = std::numeric_limits<double>::quiet_NaN();  // N m, SDCV's as named of the patient; NaN without, 0 not yet
};

// What a law is told of the time since its last step.
struct Elapsed {
  int ticks = 1;      // periods; more than one means that some were missed
  bool held = false;  // nothing newer of the peer has arrived: what was shown last is repeated
  // Since the last gap there was time for what the peer shows to be where it is, to be learnt from, and for its
  // friction.
  bool rested = true, settled = true, calm = true;
  double silent_s = 0.0;                    // since something newer was shown
  double acting = 1.0, peers_acting = 1.0;  // how much of the time the drives acted of late, here and there
};

template <int N>
struct TickTrace {
  StationState state = StationState::kOff;
  Reason reason = Reason::kStart;
  Motion<N> local, remote, target;
  Compensation compensation;
  double energy = std::numeric_limits<double>::quiet_NaN();    // J, in the tank or over what a port owes; NaN without
  double friction = std::numeric_limits<double>::quiet_NaN();  // N m, named of the peer's device; NaN without
  Chosen chosen;                                               // by AUTO
  double effort = 0.0;  // torque applied, or torque reference handed to the device, N m
  Nanoseconds playout_depth = 0;
  Nanoseconds rtt = 0;
  std::uint32_t limits = 0;
  double share = 1.0;             // of the peer's motion that is followed; less after a gap in time
  std::uint64_t cuts = 0;         // ticks so far in which something that the peer said was cut
  Misfit misfit = Misfit::kNone;  // what the last identification found
  double shaking = 0.0;           // RMS of the own axis' velocity in the band of shaking, rad/s
};

}  // namespace farhand
