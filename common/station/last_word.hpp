// What is repeated of a peer while nothing newer comes. Its velocity and torque are estimates of a noisy encoder: in
// each tick another error, which the next one makes up for. Repeated for tens of milliseconds one such error is a push
// of its own, 0.2 N m with 4096 counts (tests/gaps_test.cpp). So what was shown last counts as far as the last
// hundredths of a second bear it out; within the noise of a fine encoder it is repeated to the bit.
#pragma once

#include "common/signal/low_pass.hpp"
#include "common/signal/motion.hpp"

namespace farhand {

template <int N>
class LastWord {
 public:
  // wave: what stands in the torque's place is a sum, which has no such errors.
  LastWord(double dt_s, bool wave) : mean_v_(kMean, dt_s), mean_f_(kMean, dt_s), wave_(wave) {}

  // Nothing is known of the peer.
  void reset() noexcept { begun_ = false; }

  // Once per tick. told: as it is shown now; silent_s: since that was new.
  Motion<N> step(const Motion<N>& told, double silent_s) noexcept {
    if (!begun_) {
      begun_ = true;
      mean_v_.reset(told.v);
      mean_f_.reset(told.f);
    }
    if (silent_s <= kFresh) {
      mean_v_.step(told.v);
      mean_f_.step(told.f);
      return told;
    }
    Motion<N> word = told;
    word.v = told.v.max(mean_v_.value() - kVelocity).min(mean_v_.value() + kVelocity);
    if (!wave_) word.f = told.f.max(mean_f_.value() - kTorque).min(mean_f_.value() + kTorque);
    return word;
  }

 private:
  static constexpr Cutoff kMean = Cutoff::rad_s(60.0);
  static constexpr double kFresh = 2.5e-3;  // s, as of any packet that is late
  static constexpr double kVelocity = 0.2;  // rad/s
  static constexpr double kTorque = 0.05;   // N m
  LowPass<N> mean_v_, mean_f_;
  bool wave_, begun_ = false;
};

}  // namespace farhand
