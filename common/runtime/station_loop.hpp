// One tick of a station in a program: drain the socket, run the side, send, record, show. All objects that it uses are
// made before the loop; no function here allocates, locks or waits.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "common/config/load.hpp"
#include "common/link/codec.hpp"
#include "common/runtime/friction_keeper.hpp"
#include "common/runtime/operator_input.hpp"
#include "common/runtime/station_ports.hpp"
#include "common/runtime/stop_input.hpp"

namespace farhand {

class StationLoop {
 public:
  // duration_s counts from the peer's first packet, or from the start while there was none.
  StationLoop(Side& side, double duration_s, const StationPorts& ports);

  bool operator()(const TickTime& time) noexcept;

  // After the loop.
  StationCounters counters(const RunStats& stats) const noexcept;

 private:
  StationCounters counted() const noexcept;  // without the counts of the loop's schedule
  void receive(Nanoseconds now) noexcept;
  Asked next_act(const TickTime& time, double t_s) noexcept;

  Side& side_;
  double duration_s_;
  StationPorts ports_;
  PacketCodec<1> codec_;
  std::array<std::uint64_t, kDecodeResults> rejected_{};  // by DecodeResult; the first counts valid ones
  std::uint64_t sent_ = 0;
  double first_heard_s_ = 0.0;
  bool stopping_ = false;
  int stopping_ticks_ = 0;
};

// The objects that the main of a station has made, and the user's options.
struct StationSession {
  const LoadedScene& scene;
  Side& side;
  Role role;
  PeerLink& link;
  OperatorInput& operator_input;
  const StopSignals& stop;
  SuspendSignal& suspend;
  std::string record;  // file, or empty
  bool quiet;
  StopInput* stop_input = nullptr;
  FrictionKeeper* friction = nullptr;  // the box's
};

// Runs it to its end and prints the result; returns the exit code.
int run_station(const StationSession& session);

}  // namespace farhand
