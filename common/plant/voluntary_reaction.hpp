// A person who gives way. Who has felt more torque than he wants, one reaction time ago, draws back where he wants his
// hand to be, until no more is felt than that; once less is felt he returns. Neither is faster than his speed.
//
//   felt = K_h (x_int - x): what the spring of the arm would push with if nothing were drawn back
//   drawn back goes to  (|felt| - above)/K_h sign(felt), but not below 0,  of one reaction time ago
//
// That what is drawn back does not stand in `felt` is why there is no loop through the reaction time but by the device:
// on anything that is passive it settles. Decisions fall once per control tick and are held in between.
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

  // Throws std::invalid_argument if there is no spring to feel by, or no time between two decisions.
  VoluntaryReaction(const Params& params, double K_h)
      : step_(params.speed * params.tick), tick_(params.tick), enough_(params.above / K_h) {
    if (!(K_h > 0) || !(params.tick > 0))
      throw std::invalid_argument("a person who gives way needs an arm with stiffness, and ticks above 0 s");
    stretches_.resize(static_cast<std::size_t>(std::lround(params.after / params.tick)) + 1);
  }

  // When it decides next; counts from 0 s.
  double due() const noexcept { return tick_ * static_cast<double>(decided_ + 1); }
  double tick() const noexcept { return tick_; }
  // At that time, with x_int - x as it is then, rad.
  void decide(double stretch) noexcept {
    const std::size_t n = stretches_.size();
    stretches_[decided_ % n] = stretch;
    const double then = stretches_[++decided_ % n];  // the oldest there is; before the first one nothing was felt
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
