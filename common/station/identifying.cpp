#include "common/station/identifying.hpp"

#include <cmath>

namespace farhand {

void Identifying::begin(double x) noexcept {
  sweeps_.begin(x);
  fit_.restart();
  progress_ = IdentifyingProgress::kUnderway;
}

Motion<1> Identifying::step(const Motion<1>& local, int ticks) noexcept {
  Motion<1> to = sweeps_.step(ticks);
  to.f = -local.f;
  if (progress_ != IdentifyingProgress::kUnderway) return to;
  if (std::abs(to.x[0] - local.x[0]) > lag_) {
    progress_ = IdentifyingProgress::kBlocked;
  } else if (sweeps_.done()) {
    misfit_ = farhand::misfit(fit_.estimate(), said_);
    progress_ = misfit_ == Misfit::kNone ? IdentifyingProgress::kAsSaid : IdentifyingProgress::kAnother;
  }
  return to;
}

void Identifying::sample(double x, double torque, int ticks) noexcept {
  if (ticks > 1) fit_.interrupt();
  if (sweeps_.sweeping()) fit_.add(x, torque);
}

}  // namespace farhand
