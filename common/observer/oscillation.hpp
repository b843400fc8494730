// Is the hand being shaken? Variance of the velocity within a band above what people do on purpose and around what
// limit cycles do.
//
//   u = HP_lo^4 LP_hi^2 v,   r^2 = max(0, LPF_T[u^2] - (c q)^2),   lo = 4 Hz, hi = 60 Hz, T = 1 s
//
// The limit is what a hand that nobody shakes leaves of r at most (tests of Oscillation), all of it at once:
//
//   20 degrees each way at 2 Hz, beyond which nobody guides a movement    0.28 rad/s
//   stopped dead from 4 rad/s                                             0.23
//   tremor of 5 mrad, more than that of a calm hand, at 4 to 12 Hz        0.19
//
// Root of their squares 0.41, and a tenth for what else there is: 0.45. A patient who trembles by 50 mrad at 6 Hz needs
// a higher one. Four high-passes because 2 Hz and 4 Hz lie close together. T is long because it costs no time: what is
// strong is noticed in a few hundredths of a second, and the single events above leave less. What swings below 3 Hz
// cannot be told from voluntary motion by its frequency, only by what it has besides: its blows against stops.
//
// q, one count of the encoder: at a steady speed it shows a staircase of f steps a second, whose error is a sawtooth
// with harmonics of 2 q f each in the velocity. In the band they come to at most c q RMS, c = 32/s: no shaking, and not
// to be told from it, so it is taken off. 8 bits then hide 0.8 rad/s, 10 bits 0.2, 14 bits 0.01.
//
// First what comes from the peer is given less weight, and more again once it is calm: half of the limit over T/2. What
// does not calm down (0.5 s above the limit, or 2 s between it and its half) asks for a hold, and what shakes on when
// held (1 s) for letting go. A hand that is not driven shakes by itself: nobody may take it.
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
  bool shakes() const noexcept { return gain_ < 1; }  // or did until a moment ago
  // Driven, did not calm down, and has not since; not driven, it shakes.
  bool hold() const noexcept { return hold_; }
  // Nor when held: the loop of this very side shakes it, and only letting go helps.
  bool let_go() const noexcept { return let_go_; }

  static constexpr double kWindow = 1.0;      // s, over which the variance is taken
  static constexpr double kPersists = 0.5;    // s of lowered gain after which it is held
  static constexpr double kFall = 0.1;        // s, of the gain from 1 to kLeast
  static constexpr double kRise = 2.0;        // s, and back
  static constexpr double kLeast = 0.25;      // of the gain
  static constexpr double kStaircase = 32.0;  // 1/s, c

 private:
  using Filter = LowPass<1>;
  double limit_, staircase_, dt_s_;
  Filter high_pass_[4], low_pass_[2], variance_, recent_;
  double rms_ = 0.0, gain_ = 1.0, lasted_s_ = 0.0;
  bool hold_ = false, let_go_ = false;
};

}  // namespace farhand
