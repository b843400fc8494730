// A plant of a bare loop with its integrator, behind one interface.
#pragma once

#include <cstdint>
#include <memory>

#include "netem/lab/bare_run.hpp"
#include "proto/scene.pb.h"

namespace farhand {

// The truth of one side.
struct BareTruth {
  double x = 0, f = 0;
  const char* failure = nullptr;  // nullptr: no failure so far
  std::uint64_t steps = 0, events = 0;
};

template <class T>
class BarePlant {
 public:
  virtual ~BarePlant() = default;
  // As the encoders read them.
  virtual T angle() const noexcept = 0;
  virtual T motor_angle() const noexcept = 0;  // the joint's if there is no other
  // With the input held (N m of a motor, rad/s of a velocity-sourced one).
  virtual void advance(T input, double t1) noexcept = 0;
  virtual BareTruth truth() const noexcept = 0;
};

// T = double: every method except the closed form in long double, which is T = long double. They throw
// std::invalid_argument with the reason if the method cannot propagate the plant.
template <class T>
std::unique_ptr<BarePlant<T>> make_bare_master(const scene::Scene& scene, const BareChoice& choice);
template <class T>
std::unique_ptr<BarePlant<T>> make_bare_slave(const scene::Scene& scene, const BareChoice& choice);

}  // namespace farhand
