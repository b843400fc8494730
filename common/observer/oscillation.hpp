// Detects that the hand is being shaken: variance of the velocity within a band that lies above voluntary motion and
// around the frequencies of limit cycles.
//
//   u = HP_lo^4 LP_hi^2 v,   r^2 = max(0, LPF_T[u^2] - (c q)^2),   lo = 4 Hz, hi = 60 Hz, T = 1 s
//
// The limit is the largest r of a hand that nobody shakes (tests of Oscillation), with all causes at once:
//
//   20 degrees each way at 2 Hz, beyond which nobody guides a movement    0.28 rad/s
//   stopped dead from 4 rad/s                                             0.23
//   tremor of 5 mrad, more than that of a calm hand, at 4 to 12 Hz        0.19
//
// The root of the sum of their squares is 0.41; about a tenth is added for other causes: 0.45. A patient who trembles
// by 50 mrad at 6 Hz needs a higher limit. There are four high-passes because 2 Hz and 4 Hz lie close together. T may
// be long without delaying the detection: strong shaking is detected within a few hundredths of a second, and a long T
// reduces the effect of the single events above. The frequency of a swing below 3 Hz does not distinguish it from
// voluntary motion; only its blows against stops do.
//
// q is one count of the encoder. At a steady speed the reading is a staircase of f steps a second, whose error is a
// sawtooth with harmonics of 2 q f each in the velocity. In the band they add up to at most c q RMS, c = 32/s. This is
// not shaking but cannot be distinguished from it, so it is subtracted. 8 bits then hide 0.8 rad/s, 10 bits 0.2, 14
// bits 0.01.
//
// The first reaction is a lower gain of the peer's commands. The gain rises again once the hand is calm: below half of
// the limit for T/2. If the hand does not calm down (0.5 s above the limit, or 2 s between the limit and its half) a
// hold is requested. If it goes on shaking for 1 s while held, letting go is requested. A hand that shakes while it is
// not driven shakes by itself, and no side may engage.
#pragma once

#include "common/signal/low_pass.hpp"

namespace farhand {

struct OscillationParams {
  double limit = 0.45;      // rad/s, RMS in the band
  double resolution = 0.0;  // rad: one count
  double dt_s = 1e-3;
};

class Oscillation {
 public:
  explicit Oscillation(const OscillationParams& params) noexcept;

  // v, rad/s, of one joint. driven: by this device. ticks: periods since the last call.
  void step(double v, bool driven, int ticks = 1) noexcept;
  // At rest.
  void reset() noexcept;

  double rms() const noexcept { return rms_; }        // rad/s
  double gain() const noexcept { return gain_; }      // 1: calm
  bool shakes() const noexcept { return gain_ < 1; }  // or did so until a moment ago
  // Driven: the hand did not calm down, and has not calmed down since. Not driven: the hand shakes.
  bool hold() const noexcept { return hold_; }
  // The hand did not calm down even while held: the loop of this side shakes it, and only letting go helps.
  bool let_go() const noexcept { return let_go_; }

  static constexpr double kWindow = 1.0;      // s, over which the variance is taken
  static constexpr double kPersists = 0.5;    // s of lowered gain after which it is held
  static constexpr double kFall = 0.1;        // s, in which the gain falls from 1 to kLeast
  static constexpr double kRise = 2.0;        // s, in which it rises back to 1
  static constexpr double kLeast = 0.25;      // lowest gain
  static constexpr double kStaircase = 32.0;  // 1/s, c

 private:
  using Filter = LowPass<1>;
  double limit_, staircase_, dt_s_;
  Filter high_pass_[4], low_pass_[2], variance_, recent_;
  double rms_ = 0.0, gain_ = 1.0, lasted_s_ = 0.0;
  bool hold_ = false, let_go_ = false;
};

}  // namespace farhand
