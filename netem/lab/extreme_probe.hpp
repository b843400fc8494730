// Monitors of a running case: the first number that is not finite, and the energy of a plant.
#pragma once

#include <algorithm>
#include <cmath>

#include "netem/lab/extreme.hpp"

namespace farhand::extreme {

// It gets all numbers in the order of the data flow, so that the first bad one shows the block where it began.
class Watch {
 public:
  void see(Block block, double value) noexcept {
    if (first_bad_ == Block::kNone && !std::isfinite(value)) first_bad_ = block;
  }
  template <class Array>
  requires requires(const Array& a) { a[0], a.size(); }
  void see(Block block, const Array& values) noexcept {
    for (decltype(values.size()) i = 0; i < values.size(); ++i) see(block, static_cast<double>(values[i]));
  }
  void command(double value) noexcept {
    see(Block::kGate, value);
    bad_at_actuator_ |= !std::isfinite(value);
    largest_command_ = std::fmax(largest_command_, std::fabs(value));
  }
  void bad(Block block) noexcept {
    if (first_bad_ == Block::kNone) first_bad_ = block;
  }
  Block first_bad() const noexcept { return first_bad_; }
  bool bad_at_actuator() const noexcept { return bad_at_actuator_; }
  double largest_command() const noexcept { return largest_command_; }

 private:
  Block first_bad_ = Block::kNone;
  bool bad_at_actuator_ = false;
  double largest_command_ = 0;
};

// d(stored)/dt = supplied - dissipated, integrated by Simpson's rule over pieces of each tick.
class EnergyMeter {
 public:
  // plant: one of the world's own, without states beyond x and v; it takes the same input. pieces: even.
  template <class World, class P>
  void advance(World& world, P& plant, double input, double t0, double t1, int pieces) noexcept {
    plant.hold(input);
    const auto state = [&] {
      const auto truth = world.truth();
      return typename P::State{truth.x, truth.v};
    };
    if (!begun_) {
      begun_ = true;
      first_ = plant.stored_energy(t0, state());
    }
    const double h = (t1 - t0) / pieces;
    for (int k = 0; k <= pieces; ++k) {
      const double t = k == pieces ? t1 : t0 + k * h;
      if (k > 0) world.advance(input, t);
      const double weight = h / 3 * (k == 0 || k == pieces ? 1 : (k % 2 == 1 ? 4 : 2));
      const auto s = state();
      add(weight, plant.power(plant.mode_at(t, s), t, s));
    }
    close(plant.stored_energy(t1, state()));
  }
  void close(double stored) noexcept {
    most_ = std::fmax(most_, std::fabs(stored));
    worst_ = std::fmax(worst_, std::fabs(stored - first_ - balance_));
  }
  template <class Power>
  void add(double weight, const Power& power) noexcept {
    balance_ += weight * (power.supplied - power.dissipated);
    turned_over_ += weight * (std::fabs(power.supplied) + power.dissipated);
  }
  double worst() const noexcept { return worst_ / std::fmax(turned_over_ + most_, 1e-12); }

 private:
  bool begun_ = false;
  double first_ = 0, balance_ = 0, turned_over_ = 0, most_ = 0, worst_ = 0;
};

}  // namespace farhand::extreme
