// Nothing jumps: whenever the motion to follow comes from somewhere else, the difference at that instant is carried
// along and faded out.
//
// Position follows a smoothstep whose mean speed is bounded, and its slope is added to the velocity, so that C_p sees
// one consistent motion. The same mechanism aligns the therapist's device, engages, holds and releases.
#pragma once

#include <algorithm>

#include "common/signal/motion.hpp"

namespace farhand {

template <int N>
class Blend {
 public:
  // blend_s > 0: shortest fade; speed > 0, rad/s: bound on the mean speed of the position part.
  Blend(double blend_s, double speed) : blend_s_(blend_s), speed_(speed) {}

  // From now on the source is another one; `last` is the motion that was followed, `source` the first one of the new
  // source.
  void begin(const Motion<N>& last, const Motion<N>& source) noexcept {
    begin(last, source, std::max(blend_s_, (last.x - source.x).abs().maxCoeff() / speed_));
  }
  // The new source is where the axis is, and leads it nowhere: what is left of the old one, and the torque by which it
  // pressed, is gone within kRest, however far away it was.
  void begin_rest(const Motion<N>& last, const Motion<N>& source) noexcept {
    begin(last, source, std::min(blend_s_, kRest));
  }

  // dt_s: time since the last step or begin.
  Motion<N> step(const Motion<N>& source, double dt_s) noexcept {
    elapsed_s_ = std::min(elapsed_s_ + dt_s, length_s_);
    const double s = length_s_ > 0.0 ? elapsed_s_ / length_s_ : 1.0;
    const double left = 1.0 - s * s * (3.0 - 2.0 * s);
    const double slope = length_s_ > 0.0 ? -6.0 * s * (1.0 - s) / length_s_ : 0.0;
    return {source.x + left * residual_.x, source.v + left * residual_.v + slope * residual_.x,
            source.f + left * residual_.f};
  }

  bool done() const noexcept { return elapsed_s_ >= length_s_; }

 private:
  static constexpr double kRest = 0.5;  // s

  void begin(const Motion<N>& last, const Motion<N>& source, double length_s) noexcept {
    residual_ = {last.x - source.x, last.v - source.v, last.f - source.f};
    length_s_ = length_s;
    elapsed_s_ = 0.0;
  }

  double blend_s_, speed_;
  Motion<N> residual_;
  double length_s_ = 0.0, elapsed_s_ = 0.0;
};

}  // namespace farhand
