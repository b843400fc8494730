// The environment of the slave: a hand, a wall, both or nothing. The presence of the hand belongs to the mode, so that
// a step that ends when the hand is put in does not include it yet.
#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <optional>

#include "common/integrate/affine.hpp"
#include "common/plant/hand.hpp"
#include "common/plant/plant_mode.hpp"
#include "common/plant/wall.hpp"

namespace farhand {

class Environment {
 public:
  struct Params {
    std::optional<Hand::Params> hand = std::nullopt;
    std::optional<Wall::Params> wall = std::nullopt;
  };
  struct Truth {};                                           // no values besides the torque
  static constexpr std::size_t kGuards = 1 + Hand::kGuards;  // wall, hand

  explicit Environment(const Params& params, double /*start*/ = 0) {
    if (params.hand) hand_.emplace(*params.hand);
    if (params.wall) wall_.emplace(*params.wall);
  }

  Mode mode_at(double t, double x, double v, double a = 0) const noexcept {
    return (hand_ ? hand_->mode_at(t, x, v, a) : 0u) | (wall_ && wall_->pushes(x, v, a) ? kAtWall : 0u);
  }
  // True if a contact is closed. If not, the reaction is 0, and subtracting it would only cost time in each stage.
  static constexpr bool acts(Mode mode) noexcept { return (mode & (kHandPresent | kAtWall)) != 0; }
  // Reaction, sign of Motion::f: positive resists positive motion.
  double reaction(Mode mode, double t, double x, double v) const noexcept {
    double sum = 0;
    if ((mode & kHandPresent) != 0) sum += hand_->reaction(mode, t, x, v);
    if ((mode & kAtWall) != 0) sum += wall_->reaction(true, x, v);
    return sum;
  }
  double reaction_rate(Mode mode, double t, double x) const noexcept {  // derivative of the reaction by time
    return (mode & kHandPresent) != 0 ? hand_->reaction_rate(t, x) : 0.0;
  }
  double stiffness(Mode mode, double t) const noexcept {
    return ((mode & kHandPresent) != 0 ? hand_->stiffness(t) : 0.0) + ((mode & kAtWall) != 0 ? wall_->stiffness : 0.0);
  }
  double damping(Mode mode) const noexcept {
    return ((mode & kHandPresent) != 0 ? hand_->damping(mode) : 0.0) + ((mode & kAtWall) != 0 ? wall_->damping : 0.0);
  }
  std::array<double, kGuards> guards(Mode mode, double x, double v) const noexcept {
    std::array<double, kGuards> all{wall_ ? wall_->guard((mode & kAtWall) != 0, x, v) : kNoGuard, kNoGuard, kNoGuard};
    if (spastic(mode)) {
      const auto hand = hand_->guards(mode, x, v);
      std::copy(hand.begin(), hand.end(), all.begin() + 1);
    }
    return all;
  }
  // True if a guard can fall that does not depend on the angle alone.
  bool watches_speed(Mode mode) const noexcept { return spastic(mode); }
  FreeRange free_range(const FreeRange& range) const noexcept { return wall_ ? wall_->free_range(range) : range; }
  template <class T, std::size_t S>
  std::array<AffineGuard<T, S>, kGuards> guard_forms(Mode mode) const noexcept {
    std::array<AffineGuard<T, S>, kGuards> all;
    if (wall_) all[0] = wall_->guard_form<T, S>((mode & kAtWall) != 0);
    if (spastic(mode)) {
      const auto hand = hand_->guard_forms<T, S>(mode);
      std::copy(hand.begin(), hand.end(), all.begin() + 1);
    }
    return all;
  }
  static constexpr Mode bit(std::size_t guard) noexcept { return guard == 0 ? kAtWall : Hand::bit(guard - 1); }
  double next_break(double t) const noexcept {
    return hand_ ? hand_->next_break(t) : std::numeric_limits<double>::infinity();
  }

  double inertia() const noexcept { return 0.0; }

  // The constant part of minus the reaction at x = v = 0, and the part that varies with time.
  template <class T>
  T fixed_torque(Mode mode) const noexcept {
    T sum = 0;
    if ((mode & kHandPresent) != 0) sum += hand_->still(mode, T(0), T(0));
    if ((mode & kAtWall) != 0) sum += wall_->reaction(true, T(0), T(0));
    return -sum;
  }
  bool forced() const noexcept { return hand_ && hand_->acts(); }
  const char* not_affine() const noexcept { return hand_ ? hand_->not_affine() : nullptr; }
  template <class T>
  Forcing<T> forcing(double t) const noexcept {
    if (forced() && hand_->present(t)) return hand_->forcing<T>();
    return {.begin = T(t), .polynomial = {}, .omega = 0, .sine = 0, .cosine = 0};
  }

  double stored_energy(double t, double x, double /*v*/) const noexcept {
    return (hand_ && hand_->present(t) ? hand_->stored_energy(t, x) : 0.0) + (wall_ ? wall_->stored_energy(x) : 0.0);
  }
  PowerFlow power(Mode mode, double t, double x, double v) const noexcept {
    PowerFlow flow = (mode & kHandPresent) != 0 ? hand_->power(mode, t, x, v) : PowerFlow{};
    if (wall_) flow.dissipated += wall_->dissipated_power((mode & kAtWall) != 0, x, v);
    return flow;
  }
  Truth truth(double /*t*/) const noexcept { return {}; }
  // The mode in which all contacts act at once, which is the stiffest.
  Mode everything() const noexcept {
    return (hand_ ? kHandPresent : 0u) | (hand_ && hand_->spastic() ? kStretchedUp : 0u) | (wall_ ? kAtWall : 0u);
  }

 private:
  bool spastic(Mode mode) const noexcept { return (mode & kHandPresent) != 0 && hand_->spastic(); }

  std::optional<Hand> hand_;
  std::optional<Wall> wall_;
};

}  // namespace farhand
