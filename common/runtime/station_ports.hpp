// The interfaces of a station's loop to sources of acts and to observers of its ticks, so that the loop knows neither
// keys nor recordings nor screens. All functions are called in the loop's thread and neither allocate, lock nor wait.
#pragma once

#include <span>

#include "common/record/session.hpp"
#include "common/runtime/peer_link.hpp"
#include "common/runtime/run_loop.hpp"
#include "common/runtime/side.hpp"

namespace farhand {

struct Asked {
  OperatorAct act = OperatorAct::kNone;
  const char* said = nullptr;  // wording for the recording; null: the act's name; empty: already recorded
};

// A source of acts: the patient's stop, an operator's keys, the scene's operator.
class ActSource {
 public:
  virtual ~ActSource() = default;
  // Once per tick. taken: a source of higher priority acts in this tick; acts that can wait then wait.
  virtual Asked next(const TickTime& time, double t_s, const Side& side, bool taken) noexcept = 0;
};

struct StationTick {
  const TickTime& time;
  double t_s;  // time of the run
  const Side& side;
  Asked asked;
  const StationCounters& totals;  // so far, without the counts of the loop's schedule
};

class TickWatcher {
 public:
  virtual ~TickWatcher() = default;
  virtual void ticked(const StationTick& tick) noexcept = 0;
};

struct StationPorts {
  PeerLink* link = nullptr;
  std::span<ActSource* const> acts{};  // the first one with an act has priority
  std::span<TickWatcher* const> watchers{};
};

}  // namespace farhand
