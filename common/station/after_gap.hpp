// The share of the peer's motion that is followed after a gap in time. A gap is: ticks that this host missed, a clock
// that jumped, or ticks that the peer's host missed. (A packet that the network lost is no gap: the peer's drive was
// commanded all the while.) During a gap one of the drives has let go by itself, the person in it has moved, and the
// motion shown of the peer leaps. The share falls at once, with the length of the gap, and rises slowly: as after an
// engagement, a person whose drive has let go is led again gently. A single late tick or packet does not lower the
// share.
//
// The constants are fitted on stops of 1 to 90 ms of either program (tests/gaps_test.cpp): if the share rises within
// 0.2 s a hand of 2 N m/rad is shaken by stops of 60 ms; if it rises within 0.5 s the limits of power still act.
//
// Learning from the peer's motion waits longer, because the peer's observers also start anew after a gap.
#pragma once

#include <algorithm>
#include <cmath>

namespace farhand {

class AfterGap {
 public:
  explicit AfterGap(double dt_s) noexcept : dt_s_(dt_s) {}

  // Once per tick. silent: no newer motion of the peer can be shown than in the tick before. gap: periods since then.
  // told_s: time by which the peer missed its own ticks, computed from its packets since then. engaged: if false, no
  // motion of the peer is followed that could leap, and the share only rises. acted: mean share of the last commanded
  // torque that the drive has given since then.
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
  // Mean share of its command that the drive gave in the last 60 ms; the same for the peer's drive, from its missed
  // ticks.
  double acting() const noexcept { return acting_; }
  double peers_acting() const noexcept { return peers_acting_; }
  // Time since a newer motion of the peer was shown, s.
  double silent_s() const noexcept { return waited_s_; }
  // The last gap is long enough ago to learn where the peer's contact begins (rested), its stiffness (settled), and its
  // friction, which looks like noise (calm). Nothing is learnt while no packet comes, for whatever reason.
  bool rested() const noexcept { return !waits_ && quiet_s_ > kRested; }
  bool settled() const noexcept { return !waits_ && quiet_s_ > kSettled; }
  bool calm() const noexcept { return !waits_ && quiet_s_ > kCalm; }

 private:
  static double left(double lost_s) noexcept { return std::clamp(1.0 - lost_s / kFade, 0.0, 1.0); }

  double acts(double before, double lost_s) const noexcept {
    return (before + (1.0 - before) * (dt_s_ / kMemory)) * std::exp(-lost_s / kMemory);
  }

  static constexpr double kOwn = 1.5e-3, kPeers = 2.5e-3;  // s, longest gap that does not lower the share
  static constexpr double kFade = 0.05;                    // s, length of a gap beyond that after which the share is 0
  static constexpr double kReturn = 1.0;                   // s, in which the share rises from 0 to 1
  static constexpr double kMemory = 0.06;                  // s, time constant of the share that a drive acted
  static constexpr double kRested = 0.02, kSettled = 0.1, kCalm = 0.5;  // s
  double dt_s_;
  double share_ = 1.0, acting_ = 1.0, peers_acting_ = 1.0, waited_s_ = 0.0, told_s_ = 0.0, quiet_s_ = kCalm + 1.0;
  bool waits_ = false;
};

}  // namespace farhand
