// The therapist's arm on the device: a spring and damper towards the intended angle of the hand, and an inertia that
// moves with the device.
//
//   torque on the device = K_h (x_int - x) + B_h (v_int - v) - J_h a
//
// Because of the last term the arm's inertia appears twice: it adds to the J of the device, and it is part of the
// torque between hand and device. The current piece of the intended motion belongs to the mode, so that a step that
// ends with a movement does not include the next one yet. The angle by which a therapist who gives way has drawn back
// is held like an input of the device.
#pragma once

#include <array>
#include <limits>
#include <optional>

#include "common/plant/intended_motion.hpp"
#include "common/plant/plant_mode.hpp"
#include "common/plant/power_flow.hpp"
#include "common/plant/voluntary_reaction.hpp"

namespace farhand {

// Grip on the device: N m/rad, N m s/rad.
struct Grip {
  double K_h, B_h;
};
constexpr Grip kLightGrip{0.5, 0.01};
constexpr Grip kNormalGrip{3, 0.06};
constexpr Grip kFirmGrip{10, 0.15};

class Therapist {
 public:
  struct Params {
    double K_h = kNormalGrip.K_h;
    double B_h = kNormalGrip.B_h;
    double J_h = 0.001;
    std::vector<Movement> intended = {};
    std::optional<VoluntaryReaction::Params> reaction = std::nullopt;
  };
  struct Truth {
    double intended_x;  // rad, less the angle that is drawn back
  };
  static constexpr std::size_t kGuards = 0;

  explicit Therapist(const Params& params, double start = 0)
      : K_h_(params.K_h), B_h_(params.B_h), J_h_(params.J_h), motion_(params.intended, start) {
    if (params.reaction) reaction_.emplace(*params.reaction, K_h_);
  }

  Mode mode_at(double t, double /*x*/, double /*v*/, double /*a*/ = 0) const noexcept {
    return static_cast<Mode>(motion_.piece_at(t)) << kPieceShift;
  }
  static constexpr bool acts(Mode /*mode*/) noexcept { return true; }
  // Reaction without the part of the inertia, sign of Motion::f: positive resists positive motion.
  double reaction(Mode mode, double t, double x, double v) const noexcept {
    const IntendedMotion::Point intended = motion_.at(mode >> kPieceShift, t);
    return K_h_ * (x - (intended.x - drawn_back_)) + B_h_ * (v - (intended.v - draws_back_));
  }
  double reaction_rate(Mode mode, double t, double /*x*/) const noexcept {  // derivative of the reaction by time
    const IntendedMotion::Point intended = motion_.at(mode >> kPieceShift, t);
    return -K_h_ * intended.v - B_h_ * intended.a;
  }
  double stiffness(Mode /*mode*/, double /*t*/) const noexcept { return K_h_; }
  double damping(Mode /*mode*/) const noexcept { return B_h_; }
  std::array<double, kGuards> guards(Mode /*mode*/, double /*x*/, double /*v*/) const noexcept { return {}; }
  static constexpr bool watches_speed(Mode /*mode*/) noexcept { return false; }
  static FreeRange free_range(const FreeRange& range) noexcept { return range; }
  template <class T, std::size_t S>
  std::array<AffineGuard<T, S>, kGuards> guard_forms(Mode /*mode*/) const noexcept {
    return {};
  }
  static constexpr Mode bit(std::size_t /*guard*/) noexcept { return 0; }
  double next_break(double t) const noexcept { return motion_.next_break(t); }
  double inertia() const noexcept { return J_h_; }

  // Time of the next decision of a therapist who gives way, and the decision; +inf if there is none.
  double next_decision() const noexcept {
    return reaction_ ? reaction_->due() : std::numeric_limits<double>::infinity();
  }
  double decision_tick() const noexcept { return reaction_->tick(); }
  void decide(double t, double x) noexcept {
    reaction_->decide(motion_.at(t).x - x);
    drawn_back_ = reaction_->drawn_back();
    draws_back_ = reaction_->rate();
  }
  // Effect of the held decision on the torque on the device.
  double held_torque() const noexcept { return -(K_h_ * drawn_back_ + B_h_ * draws_back_); }

  static constexpr const char* not_affine() noexcept { return nullptr; }
  // The constant part of minus the reaction at x = v = 0, and the part that varies with time.
  template <class T>
  T fixed_torque(Mode /*mode*/) const noexcept {
    return 0;
  }
  template <class T>
  Forcing<T> forcing(double t) const noexcept {
    return motion_.forcing<T>(t, K_h_, B_h_);
  }

  double stored_energy(double t, double x, double v) const noexcept {
    const double stretch = motion_.at(t).x - drawn_back_ - x;
    return 0.5 * J_h_ * v * v + 0.5 * K_h_ * stretch * stretch;
  }
  PowerFlow power(Mode mode, double t, double x, double v) const noexcept {
    const double v_int = motion_.at(mode >> kPieceShift, t).v;
    // Between two decisions the rest angle of the spring stands still while the damper draws back: only the latter does
    // work.
    const double slip = v_int - draws_back_ - v;
    return {-reaction(mode, t, x, v) * v_int - B_h_ * slip * draws_back_, B_h_ * slip * slip};
  }
  Truth truth(double t) const noexcept { return {motion_.at(t).x - drawn_back_}; }
  Mode everything() const noexcept { return 0; }

 private:
  double K_h_, B_h_, J_h_;
  IntendedMotion motion_;
  std::optional<VoluntaryReaction> reaction_;
  double drawn_back_ = 0, draws_back_ = 0;  // rad, rad/s
};

}  // namespace farhand
