#include "common/station/homing.hpp"

#include <algorithm>
#include <cmath>

namespace farhand {

void Homing::begin(double x) noexcept {
  way_ = params_.stop > params_.back ? 1 : -1;
  returns_ = false;
  progress_ = HomingProgress::kUnderway;
  x_ref_ = x_still_ = x;
  still_s_ = 0.0;
}

Motion<1> Homing::step(const Motion<1>& local, int ticks) noexcept {
  const double x = local.x[0], dt_s = dt_s_ * ticks;
  const double target = params_.back - zero_;  // of the way back
  const bool arrived = returns_ && way_ * (target - x_ref_) <= 0.0;
  const bool pressed = way_ * local.f[0] > 0.5 * params_.torque;
  if (!(pressed || arrived) || std::abs(x - x_still_) > kStill) {
    x_still_ = x;
    still_s_ = 0.0;
  } else {
    still_s_ += dt_s;
  }
  if (still_s_ > kStill_s) {
    if (returns_) progress_ = std::abs(x - target) < kThere ? HomingProgress::kDone : HomingProgress::kBlocked;
    if (!returns_) {
      zero_ = params_.stop - x;
      returns_ = true;
      way_ = -way_;
    }
    still_s_ = 0.0;
  }
  x_ref_ = std::clamp(x_ref_ + (arrived ? 0.0 : way_ * params_.speed * dt_s), x - lead_, x + lead_);
  return {Joints<1>(x_ref_), Joints<1>(arrived ? 0.0 : way_ * params_.speed), Joints<1>::Zero()};
}

}  // namespace farhand
