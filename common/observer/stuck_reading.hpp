// Detects a reading that stands although its axis cannot have stopped: an encoder that froze for a few milliseconds. If
// it were taken for a stop, the disturbance observer would see a push against the motion and compensate it, and the
// axis would be driven on unseen (by 1.3 rad/s in 5 ms on a hand of 3 N m/rad).
//
//   x stands, and  |z| is larger than one count can hide in x, v and a,   z'' = a,  z'(0) = v
//
// v is the derivative when the reading came to stand, plus its lag a/g_v. a follows from the present torque and the
// load that was known then. An axis that really stopped at once is believed after kLongest. Nothing is judged if the
// axis may meet an object that stops it within that time, because a wall looks the same. Nothing is judged for an axis
// of several joints either: the observers would be held back for all joints, but an encoder freezes alone. (Whether an
// encoder is broken is decided later, with stronger evidence, in plausibility.hpp.)
#pragma once

#include <cmath>

#include "common/signal/cutoff.hpp"
#include "common/signal/joints.hpp"

namespace farhand {

template <int N>
class StuckReading {
 public:
  // resolution: one count, rad. stiffest: stiffest object that the axis may meet over its inertia, 1/s2. g_v, g_dis:
  // cut-offs of the derivative and of the observer from which v and a come.
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

  // x: the reading, rad. v: velocity estimated from earlier readings, rad/s. a: acceleration since then, rad/s2.
  // Returns true if the reading has just come to stand.
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

  // True if the last reading is not the angle of the axis. doubts: the axis is near a limit, so that a wrong answer
  // costs more.
  bool stuck(bool doubts) const noexcept {
    if (!judges_ || stood_ == 0 || stood_ > kLongest) return false;
    const double t = dt_s_ * stood_;
    const double hidden = (doubts ? kDoubts : kSure) * (x_noise_ + t * (v_noise_ + 0.5 * t * a_noise_));
    return (z_.abs() > hidden).any();
  }
  // Present velocity, if the reading is stuck. An axis that slows down may have turned: its deceleration is known only
  // to a factor of two, because the load is known late and the inertia may be 0.7 of the assumed one.
  Joints<N> v() const noexcept {
    const Joints<N> slowed = v_ + (v_ - came_with_);
    return (v_ * (v_ - came_with_) < 0.0).select((slowed * v_ > 0.0).select(slowed, 0.0), v_);
  }

  // Direction of the axis when the reading came to stand, as long as it may be stuck: -1, 1, or 0 if the axis was too
  // slow to tell.
  Joints<N> moved() const noexcept {
    if (!judges_ || stood_ == 0 || stood_ > kLongest) return Joints<N>::Zero();
    return (came_with_.abs() > kFast * v_noise_).select(came_with_.sign(), 0.0);
  }

 private:
  static constexpr int kLongest = 8;                   // ticks
  static constexpr double kFast = 1.05;                // times the error of v from one count
  static constexpr double kSure = 2.0, kDoubts = 1.0;  // times the motion that a count hides
  bool judges_;
  double x_noise_, v_noise_, a_noise_;  // error of each from one count, rad, rad/s, rad/s2
  double lag_s_, dt_s_;
  Joints<N> x_ = Joints<N>::Zero(), v_ = Joints<N>::Zero(), z_ = Joints<N>::Zero();
  Joints<N> came_with_ = Joints<N>::Zero();  // rad/s
  int stood_ = 0;
  bool began_ = false;
};

}  // namespace farhand
