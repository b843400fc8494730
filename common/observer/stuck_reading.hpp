// A reading that stands where its axis cannot have stopped: an encoder that froze for a few milliseconds. Taken for a
// stop it would cost more than the reading: to a disturbance observer a stop out of motion is a push against it, which
// it then makes up for, and the axis is driven on unseen (by 1.3 rad/s in 5 ms on a hand of 3 N m/rad).
//
//   x stands, and  |z| is beyond what one count may hide in x, v and a,   z'' = a,  z'(0) = v
//
// v is what the derivative said when it came to stand, and what it was behind, a/g_v; a is what the torque makes now of
// the load that was known then. Who stops at once for good is believed after kLongest. Where the axis may meet what
// stops it within that time nothing is judged: a wall looks the same. Nor is anything where the axis has several
// joints: what is held back here is held back for all of them, and an encoder freezes for itself. (Whether an encoder
// is broken, plausibility.hpp says later and by harder evidence.)
#pragma once

#include <cmath>

#include "common/signal/cutoff.hpp"
#include "common/signal/joints.hpp"

namespace farhand {

template <int N>
class StuckReading {
 public:
  // resolution: rad, one count. stiffest: 1/s2, N m/rad over kg m2 of what the axis may meet. g_v, g_dis: of what v and
  // a come from.
  StuckReading(double resolution, double stiffest, Cutoff g_v, Cutoff g_dis, double dt_s) noexcept
      : judges_(N == 1 && std::sqrt(stiffest) * dt_s * kLongest <= 1.0),
        x_noise_(resolution),
        v_noise_(resolution * g_v.rad_s() / (1.0 + g_v.rad_s() * dt_s)),
        a_noise_(v_noise_ * g_dis.rad_s()),
        lag_s_(1.0 / g_v.rad_s()),
        dt_s_(dt_s) {}

  void reset() noexcept {
    began_ = false;
    stood_ = 0;
  }

  // x: the reading, rad. v: estimated from what was read before, rad/s. a: since then, rad/s2. True where it has just
  // come to stand.
  bool step(const Joints<N>& x, const Joints<N>& v, const Joints<N>& a) noexcept {
    const bool stands = began_ && (x == x_).all(), stood = stood_ > 0;
    began_ = true;
    x_ = x;
    if (!stands) {
      stood_ = 0;
      return false;
    }
    if (!stood) {
      came_with_ = v;
      v_ = v + lag_s_ * a;
      z_.setZero();
    }
    if (stood_ > kLongest) return false;
    ++stood_;
    z_ += (v_ + 0.5 * dt_s_ * a) * dt_s_;
    v_ += dt_s_ * a;
    return !stood;
  }
  int stood() const noexcept { return stood_; }  // ticks, up to one more than kLongest

  // Is the reading of the last step not to be taken for where the axis is? doubts: it is near a limit, so that a wrong
  // answer costs more.
  bool stuck(bool doubts) const noexcept {
    if (!judges_ || stood_ == 0 || stood_ > kLongest) return false;
    const double t = dt_s_ * stood_;
    const double hidden = (doubts ? kDoubts : kSure) * (x_noise_ + t * (v_noise_ + 0.5 * t * a_noise_));
    return (z_.abs() > hidden).any();
  }
  // By now, if it is stuck. Who slows down may have turned: what slows him down is known to a half only, as the load is
  // late and the inertia may be 0.7 of what is assumed.
  Joints<N> v() const noexcept {
    const Joints<N> slowed = v_ + (v_ - came_with_);
    return (v_ * (v_ - came_with_) < 0.0).select((slowed * v_ > 0.0).select(slowed, 0.0), v_);
  }

  // Which way the axis moved when the reading came to stand, while it stands and may yet be stuck: -1, 1, or 0 where
  // it was too slow to tell.
  Joints<N> moved() const noexcept {
    if (!judges_ || stood_ == 0 || stood_ > kLongest) return Joints<N>::Zero();
    return (came_with_.abs() > kFast * v_noise_).select(came_with_.sign(), 0.0);
  }

 private:
  static constexpr int kLongest = 8;                   // ticks
  static constexpr double kFast = 1.05;                // times what one count makes of v
  static constexpr double kSure = 2.0, kDoubts = 1.0;  // times what is hidden
  bool judges_;
  double x_noise_, v_noise_, a_noise_;  // what one count may make of each, rad, rad/s, rad/s2
  double lag_s_, dt_s_;
  Joints<N> x_ = Joints<N>::Zero(), v_ = Joints<N>::Zero(), z_ = Joints<N>::Zero();
  Joints<N> came_with_ = Joints<N>::Zero();  // rad/s
  int stood_ = 0;
  bool began_ = false;
};

}  // namespace farhand
