// The first gate: every value that an authentic peer sends passes it before any block stores the value. Values within
// the limits pass unchanged, to the bit.
//
//   angle          within the own range and 5 degrees, changing no faster than the own limit of speed
//   velocity       within that limit
//   torque         within the own limit
//   wave           sent in the torque's place as its integral, sqrt(W) s, which has no bound; its slope is bounded,
//                  |u| <= (b v_max + tau_max) / sqrt(2 b), a wave that this axis could have sent
//   energy         a sum that only grows: by no more than tau_max v_max times the time
//   friction       from 0 to the own limit of torque
//
// All values are scaled to this side. Rates count from the last motion that was played, so that a gap of the network
// cuts nothing. The excess of a sum is discarded and not added later: a peer that sends wrong sums for a minute does
// not drive this side for another minute.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "common/signal/limit_bits.hpp"
#include "common/signal/motion.hpp"
#include "common/station/gate_params.hpp"

namespace farhand {

// A sum that a peer sends, with its growth bounded. A sum that was never cut passes unchanged.
class GrowingSum {
 public:
  // The next value begins the sum. A value that no session can reach begins it at 0.
  void reset() noexcept { begun_ = cut_ = false; }
  // least, most: bounds of the growth since the last call. Returns true if the growth was cut.
  bool step(double told, double least, double most) noexcept {
    if (!begun_) {
      begun_ = true;
      cut_ = !(std::abs(told) <= kLargest);
      told_ = value_ = cut_ ? 0.0 : told;
      return cut_;
    }
    const double growth = told - told_;
    const double within = growth >= least ? std::min(growth, most) : least;  // NaN counts as the least
    if (std::isfinite(told)) told_ = told;
    const bool now = !(growth == within);
    cut_ = cut_ || now;
    value_ = cut_ ? value_ + within : told;
    return now;
  }
  double value() const noexcept { return value_; }

 private:
  static constexpr double kLargest = 1e6;
  double told_ = 0.0, value_ = 0.0;
  bool begun_ = false, cut_ = false;
};

template <int N>
class Intake {
 public:
  Intake(const IntakeParams& params, double dt_s) noexcept : p_(params), dt_s_(dt_s) {}

  // Forgets the peer.
  void reset() noexcept { begun_ = false; }

  // told: motion as played out, finite. held: no newer packet has come, though an older one may only be shown now.
  // driven: a person is moved by this motion; if false, the angle may jump within the range.
  const Motion<N>& step(const Motion<N>& told, bool held, bool driven, int ticks) noexcept {
    since_s_ += dt_s_ * ticks;
    const double way = p_.velocity * since_s_;
    active_ = 0;
    const auto within = [this](double value, double low, double high, LimitBit bit) {
      if (value < low || value > high) active_ |= bit;
      return std::clamp(value, low, high);
    };
    const bool free = !begun_ || !driven;
    for (int i = 0; i < N; ++i) {
      double x = within(told.x[i], p_.range_min - kBeyond, p_.range_max + kBeyond, kLimitRange);
      if (!free) x = within(x, motion_.x[i] - way, motion_.x[i] + way, kLimitRate);
      motion_.x[i] = x;
      motion_.v[i] = within(told.v[i], -p_.velocity, p_.velocity, kLimitVelocity);
      if (p_.wave > 0.0) {
        GrowingSum& wave = wave_[static_cast<std::size_t>(i)];
        if (!begun_) wave.reset();
        const double most = p_.wave * since_s_;
        if (wave.step(told.f[i], -most, most)) active_ |= kLimitTorque;
        motion_.f[i] = wave.value();
      } else {
        motion_.f[i] = within(told.f[i], -p_.torque, p_.torque, kLimitTorque);
      }
    }
    begun_ = true;
    // A peer whose packets are always late is always `held`, but its motion changes. An angle that was too far away is
    // still approached.
    const bool moved = (told.x != told_.x).any() || (told.f != told_.f).any() || (active_ & kLimitRate) != 0;
    if (!held || moved) since_s_ = 0.0;
    told_ = told;
    if (!driven) active_ = 0;
    if (active_ != 0) ++cuts_;
    return motion_;
  }

  // told: energy since the session of the peer began, J.
  double energy(double told, bool driven, int ticks) noexcept {
    const double rate = p_.torque * p_.velocity;
    credit_ = std::min(credit_ + rate * dt_s_ * ticks, rate * kSaved);
    const double before = energy_.value();
    const bool cut = energy_.step(told, 0.0, credit_);
    credit_ -= std::clamp(energy_.value() - before, 0.0, credit_);
    if (cut && driven && active_ == 0) ++cuts_;  // once a tick
    return energy_.value();
  }

  // told: friction of the peer's device, N m, finite; negative: unknown, for which NaN is returned.
  double friction(double told) const noexcept {
    return told >= 0.0 ? std::min(told, p_.torque) : std::numeric_limits<double>::quiet_NaN();
  }

  // LimitBit: limits that cut the last motion. (A cut energy is only counted.)
  std::uint32_t active() const noexcept { return active_; }
  std::uint64_t cuts() const noexcept { return cuts_; }  // ticks in which something was cut while this side was driven

 private:
  static constexpr double kBeyond = 0.0873;  // rad: a person may push his device this far out of its range
  static constexpr double kSaved = 2.0;      // s, longest gap after which no energy is cut
  IntakeParams p_;
  double dt_s_;
  Motion<N> motion_, told_;
  GrowingSum energy_;
  std::array<GrowingSum, static_cast<std::size_t>(N)> wave_{};
  double credit_ = 0.0;
  double since_s_ = 0.0;  // since a new motion was played
  std::uint64_t cuts_ = 0;
  std::uint32_t active_ = 0;
  bool begun_ = false;
};

}  // namespace farhand
