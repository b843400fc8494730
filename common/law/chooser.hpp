// Chooses the architecture of the master for the present network and device: plain four channels while the round trip
// is short and packets arrive, else the mediator. Up to 4 ms plain four channels track within 1.2 mrad, drag with
// 0.003 N m s/rad, and render first touch with an error of 0.002 N m (the mediator: 0.004). The slave runs plain four
// channels under both. The longer the round trip, the more slowly the mediator follows new contacts, because delayed
// torque removes damping.
//
// Lost packets stir a hand that holds lightly: plain four channels then hold the last motion for a tick and jump. In an
// empty direct drive such a hand moves by 0.3 mrad at no loss, by 2 at 2 % and by 8 to 12 at 5 to 10 %, with the
// mediator by less than 0.5 (orthosis: 4.4, 5.8 and 4 to 5.5; mediator 0.4).
//
// Friction of the device is felt through plain four channels in motion and at rest: a friction of 0.05 N m drags with
// 0.05 to 0.08 N m s/rad and leaves 0.03 to 0.05 N m steadily. The mediator takes it off in free motion (drag below
// 0.03) and learns the contact without it (0.01 N m). In return it tracks with 5 to 12 mrad (plain: 1). Taken together
// as torque, the mediator is wrong by 0.01 to 0.05 N m and plain four channels by 0.05 to 0.09, whatever the loss.
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
  // On which the choice is based: s, share of packets, N m.
  double round_trip = 0.0, loss = 0.0, friction = 0.0;
};

class Chooser {
 public:
  explicit Chooser(double dt_s) : dt_s_(dt_s) {}

  // Once per tick. friction: of the peer's device as estimated, N m.
  void step(const NetworkNow& now, double friction, int ticks) noexcept {
    const double dt = dt_s_ * ticks;
    // The estimates rise at once and fall slowly: a network counts as bad as it was in the last moments.
    round_trip_ = std::max(now.round_trip, round_trip_ - std::min(1.0, dt / kForget) * (round_trip_ - now.round_trip));
    since_ += dt;
    const bool mediated = chosen_.choice == Choice::kMediated;
    const bool far = round_trip_ > (mediated ? kNear : kFar) || now.loss > (mediated ? kClean : kLossy) ||
                     friction > (mediated ? kSmooth : kDry);
    const Choice wanted = far ? Choice::kMediated : Choice::kFourChannel;
    const bool first = chosen_.choice == Choice::kNone;
    if (wanted != chosen_.choice && (first || since_ > kDwell)) {
      chosen_ = {wanted, round_trip_, now.loss, friction};
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
  // At 1 % loss a light hand moves by 2 mrad. Half of it to go back: over a second of 1000 packets the measured share
  // scatters by 0.3 %.
  static constexpr double kLossy = 0.01, kClean = 0.005;
  // N m. At 0.02 N m both are wrong by as much in free motion and against a hand, and against a wall the mediator is
  // better by half; without friction neither drags. The mediator itself identifies friction from 0.015 N m on.
  static constexpr double kDry = 0.015, kSmooth = 0.012;
  static constexpr double kDwell = 2.0, kForget = 2.0, kFade = 1.0;  // s
  static constexpr double kSettle = 1.6;                             // rad
  double dt_s_;
  double round_trip_ = 0.0, since_ = 0.0, share_ = 0.0;
  Chosen chosen_;
  int decisions_ = 0;
};

}  // namespace farhand
