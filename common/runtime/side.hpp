// One side of the teleoperator, ready to run: a station on its axis. The programs and the virtual-time lab tick the
// same object. Only the factories below know its law and its device, so that an edit of a law rebuilds little.
#pragma once

#include <memory>
#include <string>

#include "common/device/serial_counters.hpp"
#include "common/device/truth.hpp"
#include "common/link/codec.hpp"
#include "common/link/receiver.hpp"
#include "common/station/tick_trace.hpp"
#include "proto/scene.pb.h"

namespace farhand {

class Side {
 public:
  virtual ~Side() = default;

  // now: monotonic clock of this side; t_s: time of the run; ticks: periods since the last call. Returns the packet for
  // the peer.
  virtual Packet<1> tick(Nanoseconds now, double t_s, OperatorAct act, int ticks) noexcept = 0;
  // What an earlier sweep of the device has found; before the first tick.
  virtual void know(const KnownFriction& friction) noexcept = 0;
  // The program does not run: a simulated device goes on by itself, to t_s.
  virtual void go_on(double t_s) noexcept = 0;
  virtual Receipt receive(const Packet<1>& packet, Nanoseconds now) noexcept = 0;

  virtual PacketParts packet_parts() const noexcept = 0;

  virtual const TickTrace<1>& trace() const noexcept = 0;
  virtual const Receiver<1>& receiver() const noexcept = 0;
  virtual Truth truth() const noexcept = 0;
  virtual SerialCounters serial_counters() const noexcept = 0;  // zeros without a serial line
  virtual bool device_valid() const noexcept = 0;               // of the last tick
};

// True if `engage` on this side would have an effect.
inline bool both_ready(const Side& side, Nanoseconds now) noexcept {
  const auto ready = [](StationState s) { return s == StationState::kReady || s == StationState::kHolding; };
  return ready(side.trace().state) && side.receiver().alive(now) && ready(side.receiver().newest().state);
}

// The reason for its state. If a late PC could not measure the line, the PC is named and not the line.
inline const char* why_of(const Side& side) noexcept {
  const bool blind = side.trace().reason == Reason::kLineSlow && side.serial_counters().blind;
  return blind ? "this PC looks too late at its serial line" : name_of(side.trace().reason);
}

// The scene must be complete. session: drawn anew at each start, never 0. Serial ports that cannot be opened throw
// std::runtime_error.
std::unique_ptr<Side> make_simulated_master(const scene::Scene& scene, std::uint32_t session);
std::unique_ptr<Side> make_serial_master(const scene::Scene& scene, std::uint32_t session,
                                         const std::string& serial_port);
std::unique_ptr<Side> make_simulated_slave(const scene::Scene& scene, std::uint32_t session);
std::unique_ptr<Side> make_serial_slave(const scene::Scene& scene, std::uint32_t session,
                                        const std::string& serial_port);

}  // namespace farhand
