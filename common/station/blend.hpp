// The motion to follow never jumps: when its source changes, the difference at that instant is added to the new motion
// and faded out.
//
// The fade of the position is a smoothstep with bounded mean speed. Its slope is added to the velocity, so that C_p
// sees one consistent motion. The same mechanism aligns the therapist's device, engages, holds and releases.
#pragma once

#include <algorithm>

#include "common/signal/motion.hpp"

namespace farhand {

template <int N>
class Blend {
 public:
  // blend_s > 0: shortest fade; speed > 0, rad/s: bound on the mean speed of the position part.
  Blend(double blend_s, double speed) : blend_s_(blend_s), speed_(speed) {}

  // Changes the source. `last` is the motion that was followed, `source` the first motion of the new source.
  void begin(const Motion<N>& last, const Motion<N>& source) noexcept {
    begin(last, source, std::max(blend_s_, (last.x - source.x).abs().maxCoeff() / speed_));
  }
  // The same to a source that is known to be near, after a short gap of the network: from 0.2 s on. Within 0.1 s it
  // then leads by no more than 10 mrad over any way up to 5 degrees: 0.1 N m at a firm grip.
  void begin_near(const Motion<N>& last, const Motion<N>& source) noexcept {
    begin(last, source, std::min(blend_s_, kNear) + (last.x - source.x).abs().maxCoeff() / speed_);
  }
  // Engages after such a gap, with hands up to 5 degrees apart and forces that nobody awaits: longer than otherwise, so
  // that within 0.1 s a share of 5 % at most is added. The last motion stays where it was and fades out, and the source
  // counts by its share only: an observer in it moves off at once where a person has pushed against the spring of
  // Holding, and the device would follow at 1 rad/s.
  void begin_gently(const Motion<N>& last, const Motion<N>& source) noexcept {
    begin(last, source, kGently * blend_s_ + (last.x - source.x).abs().maxCoeff() / speed_);
    last_ = last;
    stays_ = true;
  }
  // Changes to a source that rests where the axis is. The difference to the old motion, and with it the torque that
  // pressed, fades out within kRest, however large it was.
  void begin_rest(const Motion<N>& last, const Motion<N>& source) noexcept {
    begin(last, source, std::min(blend_s_, kRest));
  }

  // dt_s: time since the last step or begin.
  Motion<N> step(const Motion<N>& source, double dt_s) noexcept {
    elapsed_s_ = std::min(elapsed_s_ + dt_s, length_s_);
    if (stays_) residual_ = {last_.x - source.x, last_.v - source.v, last_.f - source.f};
    const double s = length_s_ > 0.0 ? elapsed_s_ / length_s_ : 1.0;
    const double left = 1.0 - s * s * (3.0 - 2.0 * s);
    const double slope = length_s_ > 0.0 ? -6.0 * s * (1.0 - s) / length_s_ : 0.0;
    return {source.x + left * residual_.x, source.v + left * residual_.v + slope * residual_.x,
            source.f + left * residual_.f};
  }

  bool done() const noexcept { return elapsed_s_ >= length_s_; }

 private:
  static constexpr double kRest = 0.5;  // s
  static constexpr double kNear = 0.2;  // s
  static constexpr double kGently = 1.5;

  void begin(const Motion<N>& last, const Motion<N>& source, double length_s) noexcept {
    residual_ = {last.x - source.x, last.v - source.v, last.f - source.f};
    stays_ = false;
    length_s_ = length_s;
    elapsed_s_ = 0.0;
  }

  double blend_s_, speed_;
  Motion<N> residual_, last_;
  bool stays_ = false;  // last_ does, and not its difference to the source
  double length_s_ = 0.0, elapsed_s_ = 0.0;
};

}  // namespace farhand
