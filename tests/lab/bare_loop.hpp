// Both laws on both plants over a constant delay of whole ticks, engaged from the start: no codec, receiver, state
// machine, recording. What is left is what an integrator can be blamed for, and the least that a run can cost.
//
// Everything is a template over the law (the product's blocks in double, or the hand-written one in any scalar) and
// over the solver that advances the plant, so that the same loop is run, reference and competitor.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <vector>

#include "common/plant/encoder.hpp"
#include "tests/bench/plain_step.hpp"

namespace farhand {

// What one side tells the other.
template <class T>
struct Sent {
  T x{}, v{}, f{};
};

// A direct drive of the product under the law of a scene.
template <template <class> class Scene>
class BlockLaw {
 public:
  using Real = double;
  explicit BlockLaw(const SceneParams& p) : scene_(p) {}

  void start(double x) noexcept {
    scene_.drive.reset({.x = Joints<1>(x)});
    scene_.start({Joints<1>(x), Joints<1>(0.0), Joints<1>(0.0)});
  }
  // The torque to hold until the next tick.
  double step(double x, const Sent<double>& received) noexcept {
    const Motion<1> remote{Joints<1>(received.x), Joints<1>(received.v), Joints<1>(received.f)};
    local_ = scene_.drive.observe({.x = Joints<1>(x)}, 1);
    return scene_.drive.follow(local_, scene_.target(local_, remote), true, 1).torque[0];
  }
  Sent<double> sent() const noexcept { return {local_.x[0], local_.v[0], local_.f[0]}; }

 private:
  Scene<DirectDrive<1>> scene_;
  Motion<1> local_;
};

// The same law by hand.
template <PlainScene kScene, class T>
class PlainLaw {
 public:
  using Real = T;
  explicit PlainLaw(const SceneParams& p) : law_(p) {}

  void start(T x) noexcept {
    law_.reset(x);
    law_.start(x, T{}, T{});
  }
  T step(T x, const Sent<T>& received) noexcept {
    x_ = x;
    return law_.step(x, received.x, received.v, received.f);
  }
  Sent<T> sent() const noexcept { return {x_, law_.v, law_.f}; }

 private:
  PlainStep<kScene, T> law_;
  T x_{};
};

// An ideal encoder for every scalar; one with counts reads in double.
template <class T>
T read_encoder(T x, double counts_per_rev) noexcept {
  return counts_per_rev > 0 ? static_cast<T>(quantised(static_cast<double>(x), counts_per_rev)) : x;
}

// One side with a motor that takes a torque: master, or slave with a direct drive. State 0 is the angle.
template <class Law, class P, class Solver>
class DirectSide {
 public:
  using Real = typename Law::Real;

  DirectSide(const SceneParams& params, const P& plant, Solver solver, const typename Solver::State& start,
             double counts_per_rev)
      : law_(params), plant_(plant), solver_(std::move(solver)), counts_per_rev_(counts_per_rev) {
    solver_.start(plant_, 0.0, start);
    law_.start(start[0]);
  }

  // One tick and the time until the next. Returns what is sent at its beginning.
  Sent<Real> step(const Sent<Real>& received, double /*t0*/, double t1) noexcept {
    const Real x = read_encoder(static_cast<Real>(solver_.state()[0]), counts_per_rev_);
    plant_.hold(law_.step(x, received));
    solver_.advance(plant_, t1);
    return law_.sent();
  }

  const P& plant() const noexcept { return plant_; }
  const Solver& solver() const noexcept { return solver_; }

 private:
  Law law_;
  P plant_;
  Solver solver_;
  double counts_per_rev_;
};

template <class Master, class Slave>
class BareLoop {
 public:
  using Real = typename Master::Real;

  // forward, backward: delay in ticks, at least 1, because sides that tick at the same instant do not hear each other.
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

  // Since the start; the end of the last tick.
  double time() const noexcept { return static_cast<double>(ticks_) * tick_s_; }
  // What the slave hears in the next tick.
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
