#include "common/observer/plausibility.hpp"

#include <algorithm>
#include <cmath>

namespace farhand {
namespace {

// What is left of a torque behind dry friction.
double beyond(double torque, double friction) noexcept {
  return torque > friction ? torque - friction : torque < -friction ? torque + friction : 0.0;
}
double critical(double stiffness, double inertia) noexcept { return 2.0 * std::sqrt(stiffness * inertia); }

// Two spans must be over before a hand has turned the speed, after a quarter of its period: w 2 span = 0.8, half of
// that.
int span_of(const PlausibilityParams& p, int most) noexcept {
  const double w = std::sqrt(p.hand_stiffness / p.least_inertia);
  return static_cast<int>(std::min<double>(most, 0.4 / (w * p.dt_s)));
}

}  // namespace

Plausibility::Plausibility(const PlausibilityParams& p) noexcept
    : p_(p),
      settle_ticks_(static_cast<int>(std::ceil(p.settle_s / p.dt_s))),
      span_(span_of(p, kMostSpan)),
      a_(p.g_reac.rad_s() * p.dt_s / (1.0 + p.g_reac.rad_s() * p.dt_s)),
      gone_on_{p.least_inertia, p.hand_stiffness, critical(p.hand_stiffness, p.least_inertia)},
      yielded_{p.inertia, p.stiffness, std::max(p.damping, critical(p.stiffness, p.inertia))} {}

Implausible Plausibility::step(const Reading& now, int periods, int ticks) noexcept {
  // A count of missed ticks has no bound; a second is as good as any longer time.
  const int second = static_cast<int>(1.0 / p_.dt_s);
  waited_ = std::min(waited_ + ticks, second);
  if (periods == 0) return Implausible::kNo;
  const Implausible verdict = judge(now, std::max(waited_, std::min(periods, second)));
  note(now);
  waited_ = 0;
  if (verdict != Implausible::kNo) reset();
  return verdict;
}

Implausible Plausibility::judge(const Reading& now, int ticks) noexcept {
  const bool within = now.x >= p_.stop_min - kBeyondStops && now.x <= p_.stop_max + kBeyondStops;  // NaN is not
  if (!within || !std::isfinite(now.f)) return Implausible::kRange;
  seen_ = std::min(seen_ + 1, 3);
  if (seen_ == 1) {
    speed_[0] = speed_[1] = 0.0;
    still_ = in_a_row_ = 0;
    return Implausible::kNo;
  }
  const double moved = std::fabs(now.x - last_.back().x), time = ticks * p_.dt_s;
  const double reach = fastest() + p_.top_acceleration * 0.5 * (time + p_.dt_s);
  if (seen_ > 2 && moved > reach * time + p_.resolution) return Implausible::kJump;
  remember((moved + p_.resolution) / time + p_.top_acceleration * 0.5 * (time - p_.dt_s), ticks);

  const bool near_stop = now.x > p_.stop_max - kNearStop || now.x < p_.stop_min + kNearStop;
  if (near_stop || ticks > 1) in_a_row_ = 0;
  if (near_stop || ticks > 1 || moved != 0.0) {
    still_ = 0;
    return Implausible::kNo;
  }
  still_ = std::min(still_ + 1, 2 * settle_ticks_);
  const bool gone_on = should_have_gone_on(now.tau), yielded = should_have_yielded(now.f);
  return gone_on || yielded ? Implausible::kFrozen : Implausible::kNo;
}

void Plausibility::note(const Reading& now) noexcept {
  std::shift_left(last_.begin(), last_.end(), 1);
  last_.back() = now;
  in_a_row_ = std::min(in_a_row_ + 1, static_cast<int>(last_.size()));
}

void Plausibility::remember(double speed, int ticks) noexcept {
  in_stretch_ += ticks;
  if (in_stretch_ >= kMemory) {
    speed_[1] = ticks >= kMemory ? 0.0 : speed_[0];
    speed_[0] = 0.0;
    in_stretch_ = 0;
  }
  speed_[0] = std::max(speed_[0], speed);
}

// When it comes to stand: its speed is the mean over the last span, and on by half a span of the change between the
// last two and by what the motor braked besides. Of three readings, each wrong by half a count, that is 2 q over a span
// for the speed and 2 q over its square for the change.
bool Plausibility::should_have_gone_on(double tau) noexcept {
  const double dt = p_.dt_s, span = span_ * dt, J = gone_on_.inertia;
  if (still_ == 1 && span_ > 1) {
    const auto* const now = &last_.back();
    const double newer = (now->x - now[-span_].x) / span, older = (now[-span_].x - now[-2 * span_].x) / span;
    way_ = newer < 0.0 ? -1.0 : 1.0;
    tau_moving_ = way_ * now[-span_].tau;
    for (int k = span_ + 1; k < 2 * span_; ++k) tau_moving_ = std::max(tau_moving_, way_ * now[-k].tau);
    const double change = way_ * (newer - older) / span;
    double speed = way_ * newer + 0.5 * span * change - 2.0 * p_.resolution / span;
    for (int k = 0; k < span_; ++k) speed += std::min(0.0, way_ * now[-k].tau - tau_moving_) * dt / J;
    braking_ = J * std::max(0.0, 2.0 * p_.resolution / (span * span) - change);
    gone_on_.z = 0.0;
    gone_on_.v = span_ > 1 && in_a_row_ > 2 * span_ ? std::max(0.0, speed) : 0.0;
  }
  if (gone_on_.v <= 0.0) return false;
  const double seen = std::min(0.0, way_ * tau - tau_moving_);
  return gone_on_.step(seen - braking_ - p_.unseen_nm_per_s * still_ * dt, dt) > 2.0 * p_.resolution;
}

bool Plausibility::should_have_yielded(double f) noexcept {
  const double tau = last_.back().f + (f - last_.back().f) / a_;  // undoes the backward Euler of the observer
  if (still_ < 2 * settle_ticks_) {
    // A mean, because the peer's force comes with the noise of its encoder.
    const int heard = std::max(0, still_ - settle_ticks_);
    tau_still_ = heard == 0 ? tau : tau_still_ + (tau - tau_still_) / (heard + 1);
    yielded_.z = yielded_.v = 0.0;
    return false;
  }
  // One count may go for what it had left to swing back.
  return std::fabs(yielded_.step(beyond(tau - tau_still_, p_.friction), p_.dt_s)) > 2.0 * p_.resolution;
}

// Backward Euler, which is stable for every stiffness and never moves further than the thing itself would.
double Plausibility::Course::step(double torque, double dt) noexcept {
  v = (v + dt / inertia * (torque - stiffness * z)) / (1.0 + dt / inertia * (damping + dt * stiffness));
  z += dt * v;
  return z;
}

}  // namespace farhand
