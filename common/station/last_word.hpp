// The motion of the peer that is repeated while no newer one comes. Velocity and torque are estimated from a noisy
// encoder: they have another error in each tick, and successive errors cancel. One such error that is repeated for tens
// of milliseconds acts as a push, of 0.2 N m with 4096 counts (tests/gaps_test.cpp). Therefore the repeated values are
// limited to a band around their mean over the last hundredths of a second. Values within the noise of a fine encoder
// are repeated to the bit.
#pragma once

#include "common/signal/low_pass.hpp"
#include "common/signal/motion.hpp"

namespace farhand {

template <int N>
class LastWord {
 public:
  // wave: the integral of a wave stands in the torque's place; it has no such errors.
  LastWord(double dt_s, bool wave) : mean_v_(kMean, dt_s), mean_f_(kMean, dt_s), wave_(wave) {}

  // Forgets the peer.
  void reset() noexcept { begun_ = false; }

  // Once per tick. told: motion that is shown now; silent_s: time since it was new.
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
  static constexpr double kFresh = 2.5e-3;  // s, the silence of a single late packet
  static constexpr double kVelocity = 0.2;  // rad/s
  static constexpr double kTorque = 0.05;   // N m
  LowPass<N> mean_v_, mean_f_;
  bool wave_, begun_ = false;
};

}  // namespace farhand
