// On the therapist's side plain or model-mediated four channels, whichever suits the network (chooser.hpp). Both laws
// run all the time; a change is a fade from the motion of one law to that of the other.
#pragma once

#include <cstdio>

#include "common/law/chooser.hpp"
#include "common/law/four_channel.hpp"
#include "common/law/model_mediated.hpp"

namespace farhand {

inline constexpr LawBlock kChooserBlock{
    .name = "chooser",
    .why = "plain four channels up to a round trip of 4 ms, 1 % loss and 0.015 N m of friction, else the mediator",
    .without = "the scheme does not depend on the network",
    .bytes = sizeof(Chooser),
    .run = [](const LawParams& /*p*/, const FourChannelGains& /*K*/, double dt_s, std::span<const LawInputs<1>> seen) {
      Chooser chooser(dt_s);
      return sum_over(seen, [&](const LawInputs<1>& in) {
        if (in.network != nullptr) chooser.step(*in.network, 0.0, in.since.ticks);
        return chooser.share();
      });
    }};

template <int N>
class Automatic final : public Law<N> {
 public:
  static constexpr std::array kBlocks{kMediatorBlock, kChooserBlock};
  static constexpr std::array kSignals{
      ModelMediated<N>::kSignals[0],
      ModelMediated<N>::kSignals[1],
      ModelMediated<N>::kSignals[2],
      LawSignal{"mediated", "1", "the choice: 1 is the model-mediated scheme, 0 plain four channels"},
      LawSignal{"chosen_round_trip_s", "s", "round trip at the time of the choice"},
      LawSignal{"chosen_loss", "1", "loss at the time of the choice"},
      LawSignal{"chosen_friction_nm", "N m", "friction of the peer's device at the time of the choice"}};

  Automatic(const LawParams& p, const FourChannelGains& K, double dt_s)
      : Law<N>({.network = true, .previous = true}), plain_(p, K, dt_s), mediated_(p, K, dt_s), chooser_(dt_s) {}

  void start(const LawInputs<N>& in) noexcept override {
    plain_.start(in);
    mediated_.start(in);
  }

  Wish<N> step(const LawInputs<N>& in) noexcept override {
    if (in.network != nullptr) {
      chooser_.step(*in.network, mediated_.friction(), in.since.ticks);
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
    const Chosen& chosen = chooser_.chosen();
    if (chosen.choice != Choice::kNone) {
      all.own[kMediated] = chosen.choice == Choice::kMediated ? 1.0 : 0.0;
      all.own[kRoundTrip] = chosen.round_trip;
      all.own[kLoss] = chosen.loss;
      all.own[kFriction] = chosen.friction;
    }
    all.decisions = chooser_.decisions();
    all.remark = remark;
    return all;
  }

 private:
  enum : std::size_t { kMediated = ModelMediated<N>::kSignals.size(), kRoundTrip, kLoss, kFriction };

  static int remark(const LawSignals::Own& own, std::span<char> to) noexcept {
    return std::snprintf(to.data(), to.size(),
                         "auto: %s, for a round trip of %.1f ms, loss of %.1f %% and friction of %.3f N m",
                         own[kMediated] > 0.0 ? "model-mediated" : "plain four channels", 1e3 * own[kRoundTrip],
                         100 * own[kLoss], own[kFriction]);
  }

  FourChannel<N> plain_;
  ModelMediated<N> mediated_;
  Chooser chooser_;
};

}  // namespace farhand
