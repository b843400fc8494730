// A person who gives way. If the torque that he felt one reaction time ago exceeds his limit, he draws his intended
// angle back until the torque is at the limit; if it is less, he returns. Both motions are limited to his speed.
//
//   felt = K_h (x_int - x): torque of the arm's spring if nothing were drawn back
//   drawn back goes to  (|felt| - above)/K_h sign(felt), but not below 0,  of one reaction time ago
//
// `felt` excludes the angle that was drawn back. Therefore the reaction delay closes a loop only through the device;
// against a passive device that loop settles. Decisions are made once per control tick and are held in between.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <vector>

namespace farhand {

class VoluntaryReaction {
 public:
  struct Params {
    double above = 1;    // N m
    double after = 0.2;  // s
    double speed = 0.3;  // rad/s
    double tick = 1e-3;  // s, from one decision to the next
  };

  // Throws std::invalid_argument if the arm has no stiffness, or if there is no time between two decisions.
  VoluntaryReaction(const Params& params, double K_h)
      : step_(params.speed * params.tick), tick_(params.tick), enough_(params.above / K_h) {
    if (!(K_h > 0) || !(params.tick > 0))
      throw std::invalid_argument("a person who gives way needs an arm with stiffness, and ticks above 0 s");
    stretches_.resize(static_cast<std::size_t>(std::lround(params.after / params.tick)) + 1);
  }

  // Time of the next decision, counted from 0 s.
  double due() const noexcept { return tick_ * static_cast<double>(decided_ + 1); }
  double tick() const noexcept { return tick_; }
  // Makes the decision of that time. stretch: x_int - x at that time, rad.
  void decide(double stretch) noexcept {
    const std::size_t n = stretches_.size();
    stretches_[decided_ % n] = stretch;
    const double then = stretches_[++decided_ % n];  // the oldest one; before the first one no torque was felt
    const double wanted = std::copysign(std::fmax(0.0, std::fabs(then) - enough_), then);
    const double before = drawn_back_;
    drawn_back_ += std::clamp(wanted - before, -step_, step_);
    rate_ = (drawn_back_ - before) / tick_;
  }

  double drawn_back() const noexcept { return drawn_back_; }  // rad
  double rate() const noexcept { return rate_; }              // rad/s

 private:
  double step_, tick_;             // rad, s
  double enough_;                  // rad
  std::vector<double> stretches_;  // rad, of one reaction time; of fixed size
  std::size_t decided_ = 0;
  double drawn_back_ = 0, rate_ = 0;
};

}  // namespace farhand
