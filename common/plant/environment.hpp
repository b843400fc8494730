// What the slave touches: a hand, a wall, both or nothing.
#pragma once

#include <optional>

#include "common/plant/hand.hpp"
#include "common/plant/wall.hpp"

namespace farhand {

class Environment {
 public:
  struct Params {
    std::optional<Hand::Params> hand = std::nullopt;
    std::optional<Wall::Params> wall = std::nullopt;
  };

  explicit Environment(const Params& params) {
    if (params.hand) hand_.emplace(*params.hand);
    if (params.wall) wall_.emplace(*params.wall);
  }

  // Reaction, sign of Motion::f: positive resists positive motion.
  double reaction(double t, double x, double v) const noexcept {
    return (hand_ ? hand_->reaction(t, x, v) : 0.0) + (wall_ ? wall_->reaction(x, v) : 0.0);
  }
  double stored_energy(double t, double x) const noexcept {
    return (hand_ ? hand_->stored_energy(t, x) : 0.0) + (wall_ ? wall_->stored_energy(x) : 0.0);
  }
  double dissipated_power(double t, double x, double v) const noexcept {
    return (hand_ ? hand_->dissipated_power(t, v) : 0.0) + (wall_ ? wall_->dissipated_power(x, v) : 0.0);
  }

  // All that can act at once, for the choice of the step.
  double stiffness() const noexcept {
    return (hand_ ? hand_->params().stiffness : 0.0) + (wall_ ? wall_->params().stiffness : 0.0);
  }
  double damping() const noexcept {
    return (hand_ ? hand_->params().damping : 0.0) + (wall_ ? wall_->params().damping : 0.0);
  }

 private:
  std::optional<Hand> hand_;
  std::optional<Wall> wall_;
};

}  // namespace farhand
