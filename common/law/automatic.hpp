// On the therapist's side four channels or the model-mediated ones, whichever suits the network (chooser.hpp). Both run
// all the time; what is followed fades from the one to the other.
#pragma once

#include "common/law/chooser.hpp"
#include "common/law/four_channel.hpp"
#include "common/law/model_mediated.hpp"

namespace farhand {

template <int N>
class Automatic final : public Law<N> {
 public:
  Automatic(const LawParams& p, const FourChannelGains& K, double dt_s)
      : Law<N>({.network = true}), plain_(p, K, dt_s), mediated_(p, K, dt_s), chooser_(dt_s) {}

  void start(const LawInputs<N>& in) noexcept override {
    plain_.start(in);
    mediated_.start(in);
  }

  Wish<N> step(const LawInputs<N>& in) noexcept override {
    if (in.network != nullptr) {
      chooser_.step(*in.network, in.since.ticks);
      mediated_.settle(chooser_.settle());
    }
    const Wish<N> plain = plain_.step(in), model = mediated_.step(in);
    const double g = chooser_.share();
    const Motion<N>&a = plain.follow, &b = model.follow;
    return {.follow = {a.x + g * (b.x - a.x), a.v + g * (b.v - a.v), a.f + g * (b.f - a.f)},
            .tell = {in.local.x, in.local.v, in.local.f - g * mediated_.device_needs()}};
  }

  LawSignals signals() const noexcept override {
    LawSignals all = mediated_.signals();
    all.x_cdob *= chooser_.share();
    all.alpha = chooser_.share();
    all.chosen = chooser_.chosen();
    return all;
  }

 private:
  FourChannel<N> plain_;
  ModelMediated<N> mediated_;
  Chooser chooser_;
};

}  // namespace farhand
