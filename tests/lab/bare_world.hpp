// The product's own world, with the method that its scene asks for, where a bare loop expects a plant and a solver.
#pragma once

#include <array>

#include "common/plant/world.hpp"

namespace farhand {

struct Held {
  double input = 0;
  void hold(double u) noexcept { input = u; }
};

template <class World>
class WorldSolver {
 public:
  using State = std::array<double, 3>;  // angle, -, angle of the motor, as the encoders of the world read them

  explicit WorldSolver(World world) : world_(std::move(world)) {}

  void start(const Held&, double, const State&) noexcept {}  // a world starts by itself, at 0 s
  void advance(const Held& plant, double t1) noexcept { world_.advance(plant.input, t1); }
  State state() const noexcept { return {world_.encoder(), 0.0, world_.motor_encoder()}; }
  const World& world() const noexcept { return world_; }

 private:
  World world_;
};

}  // namespace farhand
