// A station of any architecture on one kind of axis, behind one face. Only its source knows the laws, so that an edit
// of one rebuilds little.
#pragma once

#include <memory>

#include "common/link/receiver.hpp"
#include "common/scene/drive_io.hpp"
#include "common/scene/params.hpp"
#include "common/scene/tick_trace.hpp"

namespace farhand {

// Io: DirectIo<1> or ReferenceIo<1>. The functions are those of Station.
template <class Io>
class AnyStation {
 public:
  struct Output {
    typename Io::Command command;
    Packet<1> packet;
  };
  virtual ~AnyStation() = default;
  virtual Receipt receive(const Packet<1>& packet, Nanoseconds now) noexcept = 0;
  virtual Output tick(Nanoseconds now, const typename Io::Sensed& sensed, OperatorAct act = OperatorAct::kNone,
                      int ticks = 1) noexcept = 0;
  virtual const TickTrace<1>& trace() const noexcept = 0;
  virtual const Receiver<1>& receiver() const noexcept = 0;
  virtual bool carries_energy() const noexcept = 0;  // in its packets
  virtual std::size_t bytes() const noexcept = 0;    // of the station behind this face
};

template <class Io>
std::unique_ptr<AnyStation<Io>> make_station(const StationParams& params);

}  // namespace farhand
