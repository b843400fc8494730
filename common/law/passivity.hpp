// Passivity observer and controller of one port (Hannaford & Ryu 2002; over a delay Ryu, Artigas & Preusche 2010): what
// a side gives to its person may never be more than what the other side took from the other person, as far as it has
// heard. What the law asks for beyond that is cut, and what was given too much a damper takes back.
//
//   margin = received - out + paid          in, out: energy that the law took from, gave to the axis, each only growing
//
// A packet carries `in`, so that a lost one loses nothing. What a side takes in pays its own deficit first: else what
// goes to and fro at rest, by an encoder's last count, would count as given on both sides for ever.
//
// What a side has over is no use to it, and the other may need it: a share of it goes back, as a tank would send it.
// Without, a spring that was pressed against a wall could never be let go of.
//
// The damper acts first; the law is cut where it does not suffice, because a cut takes away the steady torque too.
#pragma once

#include <algorithm>

namespace farhand {

// All energies in joule.
class PortPassivity {
 public:
  // damping: of the damper at most, N m s/rad.
  PortPassivity(double damping, double dt_s) : damping_(damping), sent_back_(kBack * dt_s), rise_(dt_s / kRise) {}

  // Where an engagement begins nothing is owed.
  void reset(double received) noexcept {
    received_ = received;
    out_ = paid_ = margin_ = 0.0;
  }
  // given: to the axis since the last tick; paid: the part of it that the damper took back, which is no part of the
  // law's; received: what the peer has taken in so far.
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
  // power: that the law would give now, W; negative where it takes. Afterwards share() and damping() are of this tick.
  void decide(double power) noexcept {
    const double ahead = margin_ - kLag * std::max(0.0, power);
    share_ = std::min(std::clamp(2.0 + ahead / kDeficit, 0.0, 1.0), share_ + rise_);
    damping_now_ = damping_ * std::clamp(-ahead / kDeficit, 0.0, 1.0);
  }
  // Of what the law gives, while it gives; 1 without a deficit.
  double share() const noexcept { return share_; }
  // N m s/rad; 0 without a deficit.
  double damping() const noexcept { return damping_now_; }

 private:
  static constexpr double kDeficit = 0.3e-3;  // at which the damper is whole; at twice that nothing is given any more
  static constexpr double kLag = 0.01;        // s, by which the observers bring a torque late
  static constexpr double kBack = 10.0;       // 1/s, of the margin
  static constexpr double kRise = 0.2;  // s, in which the law is given back what was cut; at once it would chatter
  double damping_, sent_back_, rise_;
  double received_ = 0.0, in_ = 0.0, out_ = 0.0, paid_ = 0.0, margin_ = 0.0;
  double share_ = 1.0, damping_now_ = 0.0;
};

}  // namespace farhand
