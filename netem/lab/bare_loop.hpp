// Both laws on both plants over a constant delay of whole ticks, engaged from the start: no codec, receiver, state
// machine or recording. The remaining errors are those of the integrator, and the time is the least that a run can
// take.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "netem/lab/bare_law.hpp"

namespace farhand {

// A side has `Sent<Real> step(received, t0, t1)`: one tick of its law, and its plant until the next tick. It returns
// the motion that is sent at the beginning of the tick.
template <class Master, class Slave>
class BareLoop {
 public:
  using Real = typename Master::Real;

  // forward, backward: delay in ticks, at least 1, because sides that tick at the same instant cannot receive each
  // other's motion in that tick.
  BareLoop(Master master, Slave slave, double tick_s, std::size_t forward, std::size_t backward, Real x_start)
      : master_(std::move(master)),
        slave_(std::move(slave)),
        tick_s_(tick_s),
        to_slave_(std::max<std::size_t>(1, forward), Sent<Real>{x_start, Real{}, Real{}}),
        to_master_(std::max<std::size_t>(1, backward), Sent<Real>{x_start, Real{}, Real{}}) {}

  void tick() noexcept {
    Sent<Real>& forward = to_slave_[forward_];
    Sent<Real>& backward = to_master_[backward_];
    const double t0 = time();
    ++ticks_;
    const Sent<Real> from_master = master_.step(backward, t0, time());
    backward = slave_.step(forward, t0, time());
    forward = from_master;
    if (++forward_ == to_slave_.size()) forward_ = 0;
    if (++backward_ == to_master_.size()) backward_ = 0;
  }

  // Time of the end of the last tick, from the start.
  double time() const noexcept { return static_cast<double>(ticks_) * tick_s_; }
  // The motion that the slave receives in the next tick.
  const Sent<Real>& at_slave() const noexcept { return to_slave_[forward_]; }
  const Master& master() const noexcept { return master_; }
  const Slave& slave() const noexcept { return slave_; }

 private:
  Master master_;
  Slave slave_;
  double tick_s_;
  std::vector<Sent<Real>> to_slave_, to_master_;  // rings: what comes out makes room for what goes in
  std::size_t forward_ = 0, backward_ = 0;
  std::int64_t ticks_ = 0;
};

}  // namespace farhand
