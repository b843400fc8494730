// Plain four channels: the received motion of the peer is followed without compensation (Daud 2011, figure 5.8).
// Architectures that compensate on the therapist's side use this law on the slave (figures 5.9-5.11).
#pragma once

#include "common/law/law.hpp"
#include "common/law/params.hpp"

namespace farhand {

template <int N>
class FourChannel final : public Law<N> {
 public:
  FourChannel(const LawParams& /*p*/, const FourChannelGains& /*K*/, double /*dt_s*/, LawNeeds needs = {})
      : Law<N>(needs) {}

  void start(const LawInputs<N>& /*in*/) noexcept override {}
  Wish<N> step(const LawInputs<N>& in) noexcept override {
    return {.follow = in.received, .tell = Told<N>::motion(in.local)};
  }
};

}  // namespace farhand
