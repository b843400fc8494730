#include "common/station/sweeping.hpp"

#include <algorithm>
#include <cmath>

namespace farhand {
namespace {

// Distance from a turning point within which the reaction is not evaluated.
double aside(const SweepingParams& p, double most, double share) noexcept {
  return std::min(most, share * (p.high - p.low));
}

}  // namespace

Sweeping::Sweeping(const SweepingParams& params, double dt_s) noexcept
    : params_(params),
      dt_s_(dt_s),
      fit_(params.low + aside(params, kSettled, kShare), params.high - aside(params, kSettled, kShare)) {}

void Sweeping::begin(double x) noexcept {
  fit_.restart();
  found_ = {};
  progress_ = SweepingProgress::kUnderway;
  start_ = x_ = x;
  v_ = rested_s_ = reaction_ = 0.0;
  way_ = 0;
}

double Sweeping::goal() const noexcept {
  if (way_ >= kWays - 1) return std::clamp(start_, params_.low, params_.high);
  return way_ % 2 == 0 ? params_.low : params_.high;
}

void Sweeping::judge(std::size_t rounds) noexcept {
  found_ = fit_.result(rounds);
  if (found_.values < static_cast<int>(LoopFrictionFit::kBins * rounds)) {
    progress_ = SweepingProgress::kBlocked;
  } else if (!(std::abs(found_.slope) <= kSteepest)) {
    progress_ = SweepingProgress::kResisted;
  } else if (!(found_.spread <= std::max(kUnevenLeast, kUneven * found_.F_c))) {
    progress_ = SweepingProgress::kUneven;
  }
}

Motion<1> Sweeping::step(const Motion<1>& local, int ticks) noexcept {
  const double dt_s = dt_s_ * ticks, f = local.f[0];
  reaction_ += std::min(1.0, dt_s / kReaction) * (f - reaction_);
  Motion<1> to;
  to.f = -local.f;
  if (progress_ == SweepingProgress::kUnderway && std::abs(reaction_) > kMost) {
    progress_ = SweepingProgress::kResisted;
  } else if (progress_ == SweepingProgress::kUnderway && std::abs(x_ - local.x[0]) > kInTheWay) {
    progress_ = SweepingProgress::kBlocked;
  }
  const double left = goal() - x_, along = left < 0.0 ? -1.0 : 1.0;
  if (progress_ == SweepingProgress::kUnderway && (rested_s_ += dt_s) > kRest) {
    v_ = std::min({v_ + kAcceleration * dt_s, kSpeed, std::sqrt(2.0 * kAcceleration * std::abs(left))});
    const double way = std::min(v_ * dt_s, std::abs(left));
    x_ += along * way;
    // A tick that follows missed ones has an angle and a reaction of different times.
    if (sweeps() && v_ == kSpeed && ticks == 1)
      fit_.add(static_cast<std::size_t>(way_ - 1) / 2, along > 0.0 ? 1 : -1, local.x[0], f);
    if (std::abs(left) - way < 1e-6) {
      v_ = rested_s_ = 0.0;
      ++way_;
      if (way_ == 3 || way_ == kWays - 1) judge(static_cast<std::size_t>(way_ - 1) / 2);
      if (way_ == kWays && progress_ == SweepingProgress::kUnderway) progress_ = SweepingProgress::kDone;
    }
  }
  to.x[0] = x_;
  to.v[0] = along * v_;
  return to;
}

}  // namespace farhand
