// How much of the peer's motion is followed after a gap in time: ticks that this host missed, a clock that jumped, or
// ticks that the peer's host missed. (What the network loses is none: the peer's drive was commanded all the while.)
// Meanwhile one of the drives has let go by itself, the person in it has moved,
// and what is shown of the peer leaps. The share of the motion to follow falls with the length of the gap, at once, and
// comes back slowly: as after an engagement, whoever has been let go of is taken again gently. A single late tick costs
// nothing, nor does a packet that is late.
//
// Fitted on stops of 1 to 90 ms of either program (tests/gaps_test.cpp): with a return within 0.2 s a hand of 2 N m/rad
// is shaken by stops of 60 ms, with 0.5 s the limits of power still act.
//
// What is learnt of the peer waits for longer: its observers, too, start anew.
#pragma once

#include <algorithm>
#include <cmath>

namespace farhand {

class AfterGap {
 public:
  explicit AfterGap(double dt_s) noexcept : dt_s_(dt_s) {}

  // Once per tick. silent: nothing newer of the peer can be shown than in the tick before; gap: periods since then;
  // told_s: by which the peer missed its own ticks, as its packets since then say; engaged: else nothing of the peer is
  // followed that could leap, and the share only comes back; acted: of the torque commanded last, what the drive
  // gave since then, on an average.
  void step(bool silent, int gap, double told_s = 0.0, bool engaged = true, double acted = 1.0) noexcept {
    const double time = dt_s_ * gap, missed = time - dt_s_;
    waited_s_ += time;
    told_s_ += told_s;
    const double waited = silent ? 0.0 : std::min(waited_s_ - dt_s_, told_s_);
    quiet_s_ = missed > kOwn || waited > kPeers ? 0.0 : std::min(quiet_s_ + dt_s_, kCalm + 1.0);
    waits_ = silent && waited_s_ - dt_s_ > kPeers;
    if (!waits_) share_ = std::min(1.0, share_ + time / kReturn);
    acting_ = acts(acting_, time * (1.0 - acted));
    if (engaged) share_ = std::min(share_, left(missed - kOwn));
    if (silent) return;
    if (engaged) share_ = std::min(share_, left(waited - kPeers));
    peers_acting_ = acts(peers_acting_, std::max(0.0, waited - kPeers));
    waited_s_ = told_s_ = 0.0;
  }

  double share() const noexcept { return share_; }
  // Of the last 60 ms, how much the drive acted; and the peer's, as far as its missed ticks tell.
  double acting() const noexcept { return acting_; }
  double peers_acting() const noexcept { return peers_acting_; }
  // s, since something newer of the peer was shown.
  double silent_s() const noexcept { return waited_s_; }
  // Long enough ago for where the peer is to be learnt, what it touches, and its friction, which noise looks like.
  // Nothing is learnt while nothing comes, for whatever reason.
  bool rested() const noexcept { return !waits_ && quiet_s_ > kRested; }
  bool settled() const noexcept { return !waits_ && quiet_s_ > kSettled; }
  bool calm() const noexcept { return !waits_ && quiet_s_ > kCalm; }

 private:
  static double left(double lost_s) noexcept { return std::clamp(1.0 - lost_s / kFade, 0.0, 1.0); }

  double acts(double before, double lost_s) const noexcept {
    return (before + (1.0 - before) * (dt_s_ / kMemory)) * std::exp(-lost_s / kMemory);
  }

  static constexpr double kOwn = 1.5e-3, kPeers = 2.5e-3;  // s, that cost nothing
  static constexpr double kFade = 0.05;                    // s, of a gap beyond that, of which nothing is left
  static constexpr double kReturn = 1.0;                   // s, from nothing to all of it
  static constexpr double kMemory = 0.06;                  // s, of how much a drive acted
  static constexpr double kRested = 0.02, kSettled = 0.1, kCalm = 0.5;  // s
  double dt_s_;
  double share_ = 1.0, acting_ = 1.0, peers_acting_ = 1.0, waited_s_ = 0.0, told_s_ = 0.0, quiet_s_ = kCalm + 1.0;
  bool waits_ = false;
};

}  // namespace farhand
