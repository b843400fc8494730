// Four-channel law in acceleration dimension, the same on both sides:
//
//   a_ref = C_p (x_remote - x) - K_f (f + f_remote),  C_p(s) = K_d s + K_p          (Daud 2011, 5.8-5.13)
//
// The law pulls the positions and velocities of both sides together and drives the torques to f + f_remote = 0. Master,
// slave and local model use the same gains: unequal K_f would scale the transmitted force by K_f,m / (K_f,m +
// K_f,model).
#pragma once

#include "common/law/params.hpp"
#include "common/signal/motion.hpp"

namespace farhand {

// Acceleration reference, rad/s2.
template <int N>
inline Joints<N> four_channel(const FourChannelGains& K, const Motion<N>& local, const Motion<N>& remote) noexcept {
  return K.K_p * (remote.x - local.x) + K.K_d * (remote.v - local.v) - K.K_f * (local.f + remote.f);
}

}  // namespace farhand
