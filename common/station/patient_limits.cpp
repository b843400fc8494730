#include "common/station/patient_limits.hpp"

#include <algorithm>
#include <cmath>

#include "common/signal/limit_bits.hpp"

namespace farhand {

MotorHeat::MotorHeat(const PatientLimits& p, double dt_s) noexcept
    : per_current2_(1.0 / (p.continuous_a * p.continuous_a)),
      T_(-p.overload_s / std::log1p(-1.0 / (p.overload * p.overload))),
      room_c_(p.room_c),
      limit_c_(p.surface_c),
      dt_s_(dt_s),
      step_(-std::expm1(-dt_s / T_)) {}

void MotorHeat::step(double current_a, int ticks) noexcept {
  const double a = ticks == 1 ? step_ : -std::expm1(-dt_s_ * ticks / T_);
  share_ += a * (current_a * current_a * per_current2_ - share_);
}

void MotorHeat::start(double surface_c) noexcept {
  share_ = std::max(0.0, (surface_c - room_c_) / (limit_c_ - room_c_));
}

void SlidingMinute::add(double amount, int ticks) noexcept {
  into_s_ += dt_s_ * ticks;
  bucket_[now_] += amount;
  sum_ += amount;
  if (into_s_ < 1.0) return;
  // A gap longer than the memory empties it; what the gap itself brought is in the newest bucket.
  const auto passed = static_cast<std::size_t>(std::min(std::floor(into_s_), 61.0));
  into_s_ -= std::floor(into_s_);
  for (std::size_t i = 0; i < passed; ++i) {
    now_ = (now_ + 1) % bucket_.size();
    bucket_[now_] = 0.0;
  }
  sum_ = 0.0;  // anew, so that rounding does not pile up over a day
  for (const double bucket : bucket_) sum_ += bucket;
}

DoseLimits::DoseLimits(const PatientLimits& limits, double dt_s) noexcept
    : limits_(limits), dt_s_(dt_s), heat_(limits, dt_s), energy_(dt_s) {}

// From the limit on it holds, and until it is no longer near.
bool DoseLimits::holds(double share, bool held, std::uint32_t bit, LimitVerdict& verdict) const noexcept {
  const bool near = share >= kWarningShare;
  if (near) verdict.warnings |= bit;
  const bool hold = share >= 1.0 || (held && near);
  if (hold) verdict.limits |= bit;
  return hold;
}

LimitVerdict DoseLimits::step(const LimitReadings& now) noexcept {
  LimitVerdict verdict;
  const double period_s = dt_s_ * now.ticks;
  const double given_w = std::max(0.0, now.power_w);
  energy_.add(given_w * period_s, now.ticks);
  if (now.surface_c && !heat_started_) heat_.start(*now.surface_c);
  heat_started_ = heat_started_ || now.surface_c.has_value();
  heat_.step(now.current_a, now.ticks);
  if (now.driven) driven_s_ += period_s;

  const double measured =
      now.surface_c ? (*now.surface_c - limits_.room_c) / (limits_.surface_c - limits_.room_c) : 0.0;
  spent_ = holds(energy_.sum() / limits_.energy_j, spent_, kLimitEnergy, verdict);
  hot_ = holds(std::max(heat_.share(), measured), hot_, kLimitHeat, verdict);
  over_ = holds(driven_s_ / limits_.session_s, false, kLimitSession, verdict);
  verdict.hold = spent_ || hot_ || over_;

  held_s_ = verdict.hold ? held_s_ + period_s : 0.0;
  mean_w_ -= std::expm1(-kPowerMean * period_s) * (given_w - mean_w_);
  if (given_w >= kWarningShare * limits_.power_w) verdict.warnings |= kLimitPower;
  const double ceiling = std::clamp((1.0 - mean_w_ / limits_.power_w) / kPowerFade, 0.0, 1.0);
  if (now.driven && ceiling < 1.0) verdict.limits |= kLimitPower;
  // Let go is let go: a limit that recovers does not take the hand back, another engagement does.
  if (held_s_ > limits_.let_go_after_s) let_go_ = true;
  if (!now.driven || (now.engaged && !verdict.hold)) let_go_ = false;
  const double pace = period_s / limits_.soft_start_s;
  // Not driven it falls as slowly: what is left of a torque drive's authority must not jump.
  gain_ = !now.driven || let_go_ ? std::max(0.0, gain_ - pace) : std::min(1.0, gain_ + pace);
  gain_ = std::min(gain_, ceiling);
  verdict.gain = gain_;
  return verdict;
}

}  // namespace farhand
