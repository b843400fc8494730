// Chooses the architecture of the master for the present network: plain four channels while the round trip is short,
// else the mediator. Up to 4 ms plain four channels track within 1.2 mrad, drag with 0.003 N m s/rad, and render first
// touch with an error of 0.002 N m (the mediator: 0.004). The slave runs plain four channels under both. The longer the
// round trip, the more slowly the mediator follows new contacts, because delayed torque removes damping.
//
// No choice is changed back within kDwell. Both laws run all the time: a change is a fade from the motion that one law
// asks for to that of the other.
#pragma once

#include <algorithm>
#include <cstdint>

#include "common/law/law.hpp"

namespace farhand {

enum class Choice : std::uint8_t { kNone, kFourChannel, kMediated };
struct Chosen {
  Choice choice = Choice::kNone;
  double round_trip = 0.0, loss = 0.0;  // s and share of packets, on which the choice is based
};

class Chooser {
 public:
  explicit Chooser(double dt_s) : dt_s_(dt_s) {}

  // Once per tick.
  void step(const NetworkNow& now, int ticks) noexcept {
    const double dt = dt_s_ * ticks;
    // The estimates rise at once and fall slowly: a network counts as bad as it was in the last moments.
    round_trip_ = std::max(now.round_trip, round_trip_ - std::min(1.0, dt / kForget) * (round_trip_ - now.round_trip));
    since_ += dt;
    const bool far = round_trip_ > (chosen_.choice == Choice::kMediated ? kNear : kFar) || now.loss > kLoss;
    const Choice wanted = far ? Choice::kMediated : Choice::kFourChannel;
    const bool first = chosen_.choice == Choice::kNone;
    if (now.round_trip > 0.0 && wanted != chosen_.choice && (first || since_ > kDwell)) {
      chosen_ = {wanted, round_trip_, now.loss};
      ++decisions_;
      since_ = 0.0;
      if (first) share_ = far ? 1.0 : 0.0;
    }
    const double aim = chosen_.choice == Choice::kMediated ? 1.0 : 0.0, step = dt / kFade;
    share_ += std::clamp(aim - share_, -step, step);
  }

  const Chosen& chosen() const noexcept { return chosen_; }
  int decisions() const noexcept { return decisions_; }  // so far
  // Weight of the mediator in the motion to follow, 0 to 1.
  double share() const noexcept { return share_ * share_ * (3.0 - 2.0 * share_); }
  // Cut-off with which the mediator's x_0 follows, rad/s.
  double settle() const noexcept { return std::clamp(kSettle / std::max(round_trip_, 1e-3), 8.0, 20.0); }

 private:
  static constexpr double kNear = 4e-3, kFar = 6e-3;  // s
  static constexpr double kLoss = 0.02;
  static constexpr double kDwell = 2.0, kForget = 2.0, kFade = 1.0;  // s
  static constexpr double kSettle = 1.6;                             // rad
  double dt_s_;
  double round_trip_ = 0.0, since_ = 0.0, share_ = 0.0;
  Chosen chosen_;
  int decisions_ = 0;
};

}  // namespace farhand
