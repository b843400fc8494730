// Wave variables: the signals on the network are neither force nor velocity but waves whose squares are the power in
// each direction, so that a constant delay stores energy and never generates it (Niemeyer & Slotine 1991; Daud 2011,
// 4.65-4.70, where 4.67 lacks a root).
//
//   master:  F_md = b V_m + sqrt(2 b) v_m          u_m = (F_md + b V_m) / sqrt(2 b)       v_m = u_s delayed
//   slave:   V_sd = (sqrt(2 b) v_s - F_s) / b      u_s = (F_s - b V_sd) / sqrt(2 b)       v_s = u_m delayed
//
// The slave follows V_sd by a spring and a damper, F_s = K_s (x_sd - x_s) + B_s (V_sd - V_s). F_s is also its torque on
// the hand. At rest x_m - x_sd = F R / (2 b) over a round trip of R.
//
// Matched impedances: an element b at an end, so that no wave is reflected there. At the slave V_sd feels F_s + b V_sd,
//   V_sd = (sqrt(2 b) v_s - F_s) / (2 b),   u_s = F_s / sqrt(2 b)         x_m^d - x_sd = 1/(2 b) int_{t-R}^t F_s (4.69)
// and at the master as well, F_md = (b V_m + sqrt(2 b) v_m) / 2, u_m = sqrt(b/2) V_m,
//                                                              x_m^d - x_sd = 1/b int_0^t F_s + x_sd             (4.70)
// which halves the motion and lets it drift under force.
//
// Packets carry the integral of the wave (common/law/wave.hpp): the next packet contains the content of a lost one, so
// that neither loss nor jitter becomes a drift.
#pragma once

#include <algorithm>
#include <cmath>

#include "common/law/params.hpp"
#include "common/signal/motion.hpp"

namespace farhand {

// A wave from its integral as played out.
template <int N>
class ReceivedWave {
 public:
  explicit ReceivedWave(double dt_s) : dt_s_(dt_s) {}

  void reset(const Joints<N>& integral) noexcept {
    last_ = integral;
    going_on_.setZero();
    owed_.setZero();
    wave_.setZero();
    was_held_ = false;
  }

  // held: nothing newer has arrived. The last wave is then continued. Once the true wave is known, the error of this is
  // corrected slowly: a correction within one tick would be a blow.
  const Joints<N>& step(const Joints<N>& integral, int ticks, bool held) noexcept {
    const double dt = dt_s_ * ticks;
    const Joints<N> came = integral - last_;
    last_ = integral;
    if (held || was_held_) {
      owed_ += came - going_on_ * dt;
    } else {
      going_on_ = came / dt;
    }
    was_held_ = held;
    const Joints<N> back = (held ? 0.0 : std::min(1.0, dt / kGiveBack)) * owed_;
    owed_ -= back;
    wave_ = going_on_ + back / dt;
    return wave_;
  }

 private:
  static constexpr double kGiveBack = 0.05;  // s
  double dt_s_;
  Joints<N> last_ = Joints<N>::Zero(), going_on_ = Joints<N>::Zero(), owed_ = Joints<N>::Zero();
  Joints<N> wave_ = Joints<N>::Zero();
  bool was_held_ = false;
};

// Waves in sqrt(W), torques in N m.
template <int N>
class MasterWave {
 public:
  explicit MasterWave(const WaveParams& p)
      : b_(p.b), root_(std::sqrt(2 * p.b)), matched_(p.matching == Matching::kBoth) {}

  // V_m: own velocity; v_m: received wave. Afterwards force() and sent() belong to this instant.
  void step(const Joints<N>& V_m, const Joints<N>& v_m) noexcept {
    F_md_ = (b_ * V_m + root_ * v_m) * (matched_ ? 0.5 : 1.0);
    u_m_ = matched_ ? Joints<N>(0.5 * root_ * V_m) : Joints<N>((F_md_ + b_ * V_m) / root_);
  }
  const Joints<N>& force() const noexcept { return F_md_; }  // against the therapist
  const Joints<N>& sent() const noexcept { return u_m_; }

 private:
  double b_, root_;
  bool matched_;
  Joints<N> F_md_ = Joints<N>::Zero(), u_m_ = Joints<N>::Zero();
};

template <int N>
class SlaveWave {
 public:
  SlaveWave(const WaveParams& p, double dt_s)
      : p_(p), dt_s_(dt_s), root_(std::sqrt(2 * p.b)), matched_(p.matching != Matching::kNone) {}

  void reset(const Joints<N>& x_s) noexcept {
    x_sd_ = x_s;
    V_sd_.setZero();
    F_s_.setZero();
    u_s_.setZero();
  }

  // local: own motion; v_s: received wave; x_m: the master's angle as played out, towards which x_sd drifts if the
  // drift setting is not 0. F_s and V_sd depend on each other within the tick; x_sd is that of the tick before.
  void step(const Motion<N>& local, const Joints<N>& v_s, const Joints<N>& x_m, int ticks) noexcept {
    const Joints<N> spring = p_.K_s * (x_sd_ - local.x) - p_.B_s * local.v;
    V_sd_ = (root_ * v_s - spring) / ((matched_ ? 2 * p_.b : p_.b) + p_.B_s);
    F_s_ = spring + p_.B_s * V_sd_;
    u_s_ = matched_ ? Joints<N>(F_s_ / root_) : Joints<N>((F_s_ - p_.b * V_sd_) / root_);
    x_sd_ += dt_s_ * ticks * (V_sd_ + p_.drift * (x_m - x_sd_));
  }
  const Joints<N>& force() const noexcept { return F_s_; }  // on the hand
  const Joints<N>& sent() const noexcept { return u_s_; }
  const Joints<N>& x_sd() const noexcept { return x_sd_; }
  const Joints<N>& V_sd() const noexcept { return V_sd_; }

 private:
  WaveParams p_;
  double dt_s_, root_;
  bool matched_;
  Joints<N> x_sd_ = Joints<N>::Zero(), V_sd_ = Joints<N>::Zero();
  Joints<N> F_s_ = Joints<N>::Zero(), u_s_ = Joints<N>::Zero();
};

}  // namespace farhand
