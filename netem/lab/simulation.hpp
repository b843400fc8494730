// The whole session in virtual time: both stations, the codec, the link and the simulated world, from one seed. No
// clock, no thread, no socket: the same numbers every time, on every machine.
#pragma once

#include <functional>
#include <memory>

#include "common/config/load.hpp"
#include "common/record/session.hpp"
#include "common/runtime/side.hpp"

namespace farhand {

inline constexpr std::uint32_t kMasterSession = 1, kSlaveSession = 2;

struct Sides {
  std::unique_ptr<Side> master, slave;
};

// The simulated sides of a scene, as every run of the lab has them.
Sides make_sides(const scene::Scene& scene);

// Observer of a run, which keeps the data that it needs; this one keeps nothing. No other data are kept, so that a run
// may last for days of virtual time.
class Witness {
 public:
  virtual ~Witness() = default;
  // After a tick of either side. act: what its operator did in it.
  virtual void ticked(bool /*master*/, const Side& /*side*/, double /*t_s*/, OperatorAct /*act*/) {}
  // A tick that the host of a side did not run: the device went on to t_s, and its true values are of that time.
  virtual void stalled(bool /*master*/, const Side& /*side*/, double /*t_s*/) {}
  // A packet entered the link.
  virtual void sent(const LinkSample& /*packet*/) {}
};

struct RunCounters {
  StationCounters master, slave;
};

// Runs a scene to its end on these sides. After the first tick only the witness may use the heap.
RunCounters simulate(const LoadedScene& loaded, const Sides& sides, Witness& witness);

// Keeps all data. `progress` (may be empty) is called with the virtual time once per virtual second.
Session simulate(const LoadedScene& loaded, const std::function<void(double)>& progress = {});

}  // namespace farhand
