// The last gate before the actuator. Whatever the laws ask for, the output is finite, within the range, and within the
// limits of rate and size. The observers get this output as the applied torque.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/signal/limit_bits.hpp"
#include "common/signal/motion.hpp"
#include "common/station/gate_params.hpp"

namespace farhand {

// For axes that take a torque.
template <int N>
class TorqueGate {
 public:
  TorqueGate(const GateParams& params, double dt_s) : params_(params), torque_step_(params.torque_rate * dt_s) {}

  // wish: torque asked for, N m; x: present position, rad. Returns the torque to apply. If one element is not finite,
  // the whole vector is replaced by zero, because the other elements alone are not the motion that was meant. Outward
  // torque fades out over the last kFade before the end of the range.
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

  // Ticks were missed, and the drive has let its torque fall to this share.
  void decayed(double share) noexcept { applied_ *= share; }

  const Joints<N>& applied() const noexcept { return applied_; }
  std::uint32_t active() const noexcept { return active_; }

 private:
  static constexpr double kFade = 0.0175;  // rad, one degree
  GateParams params_;
  double torque_step_;
  Joints<N> applied_ = Joints<N>::Zero();
  std::uint32_t active_ = 0;
};

// For axes that close their own loop and take references. The reference position moves with bounded velocity and
// acceleration and can always stop before the end of the range. A motion within the bounds passes unchanged.
template <int N>
class ReferenceGate {
 public:
  ReferenceGate(const GateParams& params, double dt_s) : params_(params), dt_s_(dt_s) {}

  void limit(const GateParams& params) noexcept { params_ = params; }  // from now on

  // The next reference starts from x, at rest: call it while the axis is not driven.
  void reset(const Joints<N>& x) noexcept {
    if (x.allFinite()) reference_ = {x, Joints<N>::Zero(), Joints<N>::Zero()};
    step_.setZero();
    wished_ = reference_.x;
    active_ = 0;
  }

  // ticks: periods since the last call; a missed tick does not make the reference fall behind. If one element is not
  // finite, the reference comes to rest.
  const Motion<N>& pass(const Motion<N>& wish, int ticks = 1) noexcept {
    const bool finite = wish.finite();
    active_ = finite ? 0u : kLimitNotFinite;
    const double most = params_.velocity * dt_s_ * ticks;
    const double change = params_.acceleration * dt_s_ * ticks;  // of a velocity
    for (int i = 0; i < N; ++i) {
      double& x = reference_.x[i];
      const double aim = finite ? clip(wish.x[i], params_.range_min, params_.range_max, kLimitRange) : x;
      double to = clip(aim, x - most, x + most, kLimitRate);
      if (change < kUnbounded) {
        to = accelerate(i, aim, to, ticks);
        step_[i] = (to - x) / (dt_s_ * ticks);
        wished_[i] = aim;
      }
      x = to;
      const double v = finite ? clip(wish.v[i], -params_.velocity, params_.velocity, kLimitVelocity) : 0.0;
      reference_.v[i] = clip(v, reference_.v[i] - change, reference_.v[i] + change, kLimitAcceleration);
      reference_.f[i] = finite ? clip(wish.f[i], -params_.torque, params_.torque, kLimitTorque) : 0.0;
    }
    return reference_;
  }

  const Motion<N>& applied() const noexcept { return reference_; }
  std::uint32_t active() const noexcept { return active_; }

 private:
  static constexpr double kUnbounded = 1e300;
  static constexpr double kRounding = 1e-12;  // rad

  double clip(double u, double low, double high, std::uint32_t bit) noexcept {
    if (u < low || u > high) active_ |= bit;
    return u < low ? low : (u > high ? high : u);
  }

  // Largest speed, in steps of `change`, at which a distance q (in steps of change * dt_s) may be entered so that the
  // motion ends at rest. The first period lasts `ticks`, and each later period slows by one step. The sum n + (n - 1) +
  // ... over the later periods is triangular in n and linear between whole n.
  static double entry(double q, int ticks) noexcept {
    const double k = ticks - 1.0, b = 2.0 * k + 1.0;
    const double m = std::max(0.0, std::floor(0.5 * (std::sqrt(b * b + 8.0 * q) - b)));
    return m + (q - k * m - 0.5 * m * (m + 1.0)) / (k + m + 1.0);
  }
  double entry_speed(double way, int ticks) const noexcept {
    if (!(way < kUnbounded)) return way;
    const double change = params_.acceleration * dt_s_;
    return change * entry(std::max(0.0, way) / (change * dt_s_), ticks);
  }

  // The position to go to instead of `to`, so that the speed changes by no more than allowed, now and until the axis
  // rests at `aim`, or, if `aim` moves on at its speed, until both move alike.
  double accelerate(int i, double aim, double to, int ticks) noexcept {
    const double x = reference_.x[i], period = dt_s_ * ticks, change = params_.acceleration * period;
    const double highest = std::min({params_.velocity, step_[i] + change, entry_speed(params_.range_max - x, ticks)});
    const double lowest = std::max({-params_.velocity, step_[i] - change, -entry_speed(x - params_.range_min, ticks)});
    const double behind = wished_[i] - x, moves = (aim - wished_[i]) / period;
    const double wish =
        behind == 0.0 ? (to - x) / period : moves + std::copysign(entry_speed(std::abs(behind), ticks), behind);
    // The end of the range never requires more than this change, except by rounding.
    const double speed =
        std::clamp(std::clamp(wish, std::min(lowest, highest), highest), step_[i] - change, step_[i] + change);
    const double inside_min = std::min(params_.range_min, x), inside_max = std::max(params_.range_max, x);
    const double next = std::clamp(x + speed * period, inside_min, inside_max);
    if (std::abs(next - to) < kRounding) return to;
    active_ |= kLimitAcceleration;
    return std::abs(next - aim) < kRounding ? aim : next;
  }

  GateParams params_;
  double dt_s_;
  Motion<N> reference_;
  Joints<N> wished_ = Joints<N>::Zero();  // position, inside the range
  Joints<N> step_ = Joints<N>::Zero();    // velocity of the position, rad/s
  std::uint32_t active_ = 0;
};

}  // namespace farhand
