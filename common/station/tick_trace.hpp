// Values of one tick, for recordings and the status line.
#pragma once

#include "common/identify/loop_friction.hpp"
#include "common/identify/misfit.hpp"
#include "common/law/law.hpp"
#include "common/signal/known_friction.hpp"
#include "common/station/states.hpp"

namespace farhand {

template <int N>
struct TickTrace {
  StationState state = StationState::kOff;
  Reason reason = Reason::kStart;
  Motion<N> local, remote, target;
  LawSignals law;
  double effort = 0.0;  // torque applied, or torque reference handed to the device, N m
  Nanoseconds playout_depth = 0;
  Nanoseconds rtt = 0;
  std::uint32_t limits = 0;
  double share = 1.0;             // of the peer's motion that is followed; below 1 after a gap in time
  std::uint64_t cuts = 0;         // ticks so far in which a value of the peer was cut
  Misfit misfit = Misfit::kNone;  // result of the last identification
  LoopFriction swept;             // result of the last sweep, whether it was refused or not
  KnownFriction friction;         // of the own device, as the peer is told
  bool waits = false;             // holds for a gap of the network, and may go on after it without an act
  bool resumes = false;           // goes on after one
  std::size_t resumed = 0;        // so often in the last minute
  double shaking = 0.0;           // RMS of the own axis' velocity in the band of shaking, rad/s
};

}  // namespace farhand
