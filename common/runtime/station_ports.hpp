// What a station's loop is told and by whom, and who looks on: two small faces, so that the loop knows neither keys nor
// recordings nor screens. Everything here is called in the loop's thread and neither allocates, locks nor waits.
#pragma once

#include <span>

#include "common/record/session.hpp"
#include "common/runtime/peer_link.hpp"
#include "common/runtime/run_loop.hpp"
#include "common/runtime/side.hpp"

namespace farhand {

struct Asked {
  OperatorAct act = OperatorAct::kNone;
  const char* said = nullptr;  // how a recording words it; none: by the act's name; empty: it has been said before
};

// Who may ask for something: the patient's stop, an operator's keys, the scene's people.
class ActSource {
 public:
  virtual ~ActSource() = default;
  // Once per tick. taken: one that comes before this one is heard in this tick; what can wait waits.
  virtual Asked next(const TickTime& time, double t_s, const Side& side, bool taken) noexcept = 0;
};

struct StationTick {
  const TickTime& time;
  double t_s;  // time of the run
  const Side& side;
  Asked asked;
  const StationCounters& totals;  // so far; but for what the loop's schedule counts
};

class TickWatcher {
 public:
  virtual ~TickWatcher() = default;
  virtual void ticked(const StationTick& tick) noexcept = 0;
};

struct StationPorts {
  PeerLink* link = nullptr;
  std::span<ActSource* const> acts{};  // the first that asks is heard
  std::span<TickWatcher* const> watchers{};
};

}  // namespace farhand
