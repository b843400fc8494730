// Passivity observer and controller of one port (Hannaford & Ryu 2002; over a delay Ryu, Artigas & Preusche 2010). A
// side may never give its person more energy than the other side has reported to have taken from the other person.
// Torque of the law that would exceed this is cut, and a damper takes back energy that was given in excess.
//
//   margin = received - out + paid          in, out: energy that the law took from, gave to the axis, each only growing
//
// A packet carries the sum `in`, so that a lost packet loses no energy. Energy that a side takes in first cancels its
// own deficit; otherwise encoder dither at rest would be booked as delivered energy on both sides for ever.
//
// Surplus energy is of no use to a side, but the other side may need it: a fixed share of it per time is sent back, as
// an energy tank would do. Otherwise a spring that was pressed against a wall could not be released.
//
// The damper acts first. The law is cut only when the damper does not suffice, because a cut also removes steady
// torque.
#pragma once

#include <algorithm>

namespace farhand {

// All energies in joule.
class PortPassivity {
 public:
  // damping: largest damping of the damper, N m s/rad.
  PortPassivity(double damping, double dt_s) : damping_(damping), sent_back_(kBack * dt_s), rise_(dt_s / kRise) {}

  // An engagement begins without deficit.
  void reset(double received) noexcept {
    received_ = received;
    out_ = paid_ = margin_ = 0.0;
  }
  // given: energy given to the axis since the last tick; paid: energy that the damper took back in that time, which is
  // not the law's; received: energy that the peer has taken in so far. All in J.
  void step(double given, double paid, double received) noexcept {
    const double by_law = given + paid;
    out_ += std::max(0.0, by_law);
    const double taken = std::max(0.0, -by_law), own = std::min(taken, std::max(0.0, -margin_));
    in_ += taken - own;
    paid_ += paid + own;
    const double back = sent_back_ * std::max(0.0, margin_);
    in_ += back;
    paid_ -= back;
    margin_ = std::max(0.0, received - received_) - out_ + paid_;
  }

  double margin() const noexcept { return margin_; }
  double in() const noexcept { return in_; }
  // power: power that the law would give now, W; negative if it takes. Afterwards share() and damping() belong to this
  // tick.
  void decide(double power) noexcept {
    const double ahead = margin_ - kLag * std::max(0.0, power);
    share_ = std::min(std::clamp(2.0 + ahead / kDeficit, 0.0, 1.0), share_ + rise_);
    damping_now_ = damping_ * std::clamp(-ahead / kDeficit, 0.0, 1.0);
  }
  // Share of the law's torque, for a torque that gives energy; 1 without a deficit.
  double share() const noexcept { return share_; }
  // Damping of the damper, N m s/rad; 0 without a deficit.
  double damping() const noexcept { return damping_now_; }

 private:
  static constexpr double kDeficit = 0.3e-3;  // J, at which the damper is full; at twice that the share is 0
  static constexpr double kLag = 0.01;        // s, lag of a torque behind its command
  static constexpr double kBack = 10.0;       // 1/s, of the margin
  static constexpr double kRise = 0.2;        // s, in which a cut share recovers; a step would chatter
  double damping_, sent_back_, rise_;
  double received_ = 0.0, in_ = 0.0, out_ = 0.0, paid_ = 0.0, margin_ = 0.0;
  double share_ = 1.0, damping_now_ = 0.0;
};

}  // namespace farhand
