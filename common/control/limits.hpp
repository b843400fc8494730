// The last gate before the actuator. Whatever the laws wish, what leaves here is finite, inside the range, slow enough
// and small enough, and what leaves here is what the observers are told was applied.
#pragma once

#include <algorithm>

#include "common/control/params.hpp"
#include "common/signal/limit_bits.hpp"
#include "common/signal/motion.hpp"

namespace farhand {

// For axes that take a torque.
template <int N>
class TorqueGate {
 public:
  TorqueGate(const GateParams& params, double dt_s) : params_(params), torque_step_(params.torque_rate * dt_s) {}

  // wish: N m; x: position now. Returns the torque to apply. Not finite anywhere: the whole wish is replaced by zero,
  // because half a vector is not a motion. Outward torque fades out over the last kFade before the end of the range.
  const Joints<N>& pass(const Joints<N>& wish, const Joints<N>& x) noexcept {
    active_ = 0;
    Joints<N> tau = wish;
    if (!wish.allFinite() || !x.allFinite()) {
      tau.setZero();
      active_ |= kLimitNotFinite;
    }
    const Joints<N> position = x.allFinite() ? x : Joints<N>::Zero();
    const Joints<N> room_up = params_.torque * ((params_.range_max - position) / kFade).max(0.0).min(1.0);
    const Joints<N> room_down = params_.torque * ((position - params_.range_min) / kFade).max(0.0).min(1.0);
    for (int i = 0; i < N; ++i) {
      if (tau[i] > params_.torque || tau[i] < -params_.torque) active_ |= kLimitTorque;
      tau[i] = std::clamp(tau[i], -params_.torque, params_.torque);
      if (tau[i] > room_up[i] || tau[i] < -room_down[i]) active_ |= kLimitRange;
      tau[i] = std::clamp(tau[i], -room_down[i], room_up[i]);
      const double change = tau[i] - applied_[i];
      if (change > torque_step_ || change < -torque_step_) {
        active_ |= kLimitRate;
        tau[i] = applied_[i] + (change > 0 ? torque_step_ : -torque_step_);
      }
    }
    applied_ = tau;
    return applied_;
  }

  void limit(const GateParams& params) noexcept { params_ = params; }  // keeps the rate

  // Zero without a ramp.
  const Joints<N>& cut() noexcept {
    active_ = 0;
    applied_.setZero();
    return applied_;
  }

  const Joints<N>& applied() const noexcept { return applied_; }
  std::uint32_t active() const noexcept { return active_; }

 private:
  static constexpr double kFade = 0.0175;  // rad, one degree
  GateParams params_;
  double torque_step_;
  Joints<N> applied_ = Joints<N>::Zero();
  std::uint32_t active_ = 0;
};

// For axes that close their own loop and take references.
template <int N>
class ReferenceGate {
 public:
  ReferenceGate(const GateParams& params, double dt_s) : params_(params), step_(params.velocity * dt_s) {}

  void limit(const GateParams& params) noexcept { params_ = params; }  // keeps the velocity of a position

  // The next reference starts from x: call it while the axis is not driven.
  void reset(const Joints<N>& x) noexcept {
    if (x.allFinite()) reference_ = {x, Joints<N>::Zero(), Joints<N>::Zero()};
    active_ = 0;
  }

  // ticks: periods since the last call; a missed tick does not make the reference fall behind.
  const Motion<N>& pass(const Motion<N>& wish, int ticks = 1) noexcept {
    active_ = 0;
    if (!wish.finite()) {
      reference_.v.setZero();
      reference_.f.setZero();
      active_ = kLimitNotFinite;
      return reference_;
    }
    const double step = step_ * ticks;
    for (int i = 0; i < N; ++i) {
      double x = clip(wish.x[i], params_.range_min, params_.range_max, kLimitRange);
      x = clip(x, reference_.x[i] - step, reference_.x[i] + step, kLimitRate);
      reference_.x[i] = x;
      reference_.v[i] = clip(wish.v[i], -params_.velocity, params_.velocity, kLimitVelocity);
      reference_.f[i] = clip(wish.f[i], -params_.torque, params_.torque, kLimitTorque);
    }
    return reference_;
  }

  const Motion<N>& applied() const noexcept { return reference_; }
  std::uint32_t active() const noexcept { return active_; }

 private:
  double clip(double u, double low, double high, std::uint32_t bit) noexcept {
    if (u < low || u > high) active_ |= bit;
    return u < low ? low : (u > high ? high : u);
  }

  GateParams params_;
  double step_;
  Motion<N> reference_;
  std::uint32_t active_ = 0;
};

}  // namespace farhand
