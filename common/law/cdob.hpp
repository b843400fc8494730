// Communication disturbance observer: where will the slave be when it has seen what the master does now?
//
//   x_cdob = LPF_gnet( x_model - x_received ),   x_p = x_received + x_cdob          (Daud 2011, 5.14)
//
// The network's delay is treated as a disturbance on a local model of the slave. The observer as drawn (5.10)
// differentiates twice, filters and integrates twice, which amplifies noise and drifts. Telescoped to the difference
// above it has the same transfer function with two states that neither amplify nor drift; v is treated in the same way.
// The model's loop is closed with the full x_cdob: if x_cdob were scaled there (SDCV), the model would wind up and kick
// on release.
//
// The thesis leaves open whether the model includes f_s. kThesis: a_model = C_p (x_m - x_p) - K_f f_m. It halves the
// steady force (test SteadyContact.ThesisModelHalvesTheForce) and is stable on stiff hands. kWithForce adds - K_f f_s:
// its steady force is right, but it is unstable on stiff hands.
#pragma once

#include "common/law/params.hpp"
#include "common/signal/low_pass.hpp"
#include "common/signal/motion.hpp"

namespace farhand {

template <int N>
class Cdob {
 public:
  Cdob(const FourChannelGains& K, Cutoff g_net, LocalModel local_model, double dt_s)
      : K_(K),
        with_force_(local_model == LocalModel::kWithForce),
        dt_s_(dt_s),
        x_filter_(g_net, dt_s),
        v_filter_(g_net, dt_s) {}

  // The model starts where the slave was last heard of; x_cdob starts at zero.
  void reset(const Motion<N>& received) noexcept {
    x_model_ = received.x;
    v_model_ = received.v;
    x_filter_.reset(Joints<N>::Zero());
    v_filter_.reset(Joints<N>::Zero());
  }

  // local: the master now; received: the slave as played out. Afterwards x_cdob() and v_cdob() belong to this instant.
  void step(const Motion<N>& local, const Motion<N>& received) noexcept {
    x_filter_.step(x_model_ - received.x);
    v_filter_.step(v_model_ - received.v);
    const Joints<N> x_p = received.x + x_filter_.value();
    const Joints<N> v_p = received.v + v_filter_.value();
    Joints<N> a_model = K_.K_p * (local.x - x_p) + K_.K_d * (local.v - v_p) - K_.K_f * local.f;
    if (with_force_) a_model -= K_.K_f * received.f;
    v_model_ += dt_s_ * a_model;
    x_model_ += dt_s_ * v_model_;
  }

  const Joints<N>& x_cdob() const noexcept { return x_filter_.value(); }
  const Joints<N>& v_cdob() const noexcept { return v_filter_.value(); }

 private:
  FourChannelGains K_;
  bool with_force_;
  double dt_s_;
  LowPass<N> x_filter_, v_filter_;
  Joints<N> x_model_ = Joints<N>::Zero();
  Joints<N> v_model_ = Joints<N>::Zero();
};

}  // namespace farhand
