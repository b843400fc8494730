#include "common/observer/oscillation.hpp"

#include <algorithm>
#include <cmath>

namespace farhand {
namespace {

constexpr Cutoff kLow = Cutoff::hz(4.0), kHigh = Cutoff::hz(60.0);

}  // namespace

Oscillation::Oscillation(const OscillationParams& p) noexcept
    : limit_(p.limit),
      staircase_(kStaircase * p.resolution * kStaircase * p.resolution),
      dt_s_(p.dt_s),
      high_pass_{{kLow, dt_s_}, {kLow, dt_s_}, {kLow, dt_s_}, {kLow, dt_s_}},
      low_pass_{{kHigh, dt_s_}, {kHigh, dt_s_}},
      variance_(Cutoff::rad_s(1.0 / kWindow), dt_s_),
      recent_(Cutoff::rad_s(2.0 / kWindow), dt_s_) {}

void Oscillation::step(double v, bool driven, int ticks) noexcept {
  Joints<1> u(v);
  for (Filter& filter : high_pass_) u = u - filter.step(u);
  for (Filter& filter : low_pass_) u = filter.step(u);
  rms_ = std::sqrt(std::max(0.0, variance_.step(u * u)[0] - staircase_));
  const double time = ticks * dt_s_;
  const bool calm = recent_.step(u * u)[0] - staircase_ < 0.25 * limit_ * limit_;
  const bool shaken = rms_ > limit_ && !calm;
  if (shaken) gain_ = std::max(kLeast, gain_ - (1.0 - kLeast) * time / kFall);
  if (calm) gain_ = driven ? std::min(1.0, gain_ + (1.0 - kLeast) * time / kRise) : 1.0;
  // Counted until all the gain is back: what begins again under the returning gain has not calmed down.
  if (!driven || gain_ == 1.0) {
    lasted_s_ = 0.0;
    let_go_ = false;
    hold_ = shakes();
    return;
  }
  if (shaken) lasted_s_ += time;
  // Held it is judged anew: what the hand did before, and how it comes to rest, is no reason to let go of it.
  if (hold_) {
    let_go_ = lasted_s_ > 2.0 * kPersists;
    return;
  }
  if (!shaken && !calm) lasted_s_ += 0.25 * time;
  if (lasted_s_ <= kPersists) return;
  hold_ = true;
  lasted_s_ = 0.0;
  variance_.reset(Joints<1>::Zero());
  recent_.reset(Joints<1>::Zero());
}

void Oscillation::reset() noexcept {
  for (Filter& filter : high_pass_) filter.reset(Joints<1>::Zero());
  for (Filter& filter : low_pass_) filter.reset(Joints<1>::Zero());
  variance_.reset(Joints<1>::Zero());
  recent_.reset(Joints<1>::Zero());
  rms_ = lasted_s_ = 0.0;
  gain_ = 1.0;
  hold_ = let_go_ = false;
}

}  // namespace farhand
