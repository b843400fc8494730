// Four channels with a communication disturbance observer on the therapist's side (Daud 2011, figure 5.9): the observer
// adds its compensation to the received angle, so that the angle to follow is not delayed.
#pragma once

#include "common/law/cdob.hpp"
#include "common/law/law.hpp"
#include "common/law/row.hpp"

namespace farhand {

inline constexpr LawBlock kCdobBlock{
    .name = "CDOB",
    .why = "predicts the slave over the round trip",
    .without = "the round trip stays uncompensated by an observer",
    .bytes = sizeof(Cdob<1>),
    .settings = {"control.g_net_rad_s", "control.local_model"},
    .idle = Idle::kWithoutDelay,
    .instead = "FOUR_CHANNEL",
    .run = [](const LawParams& p, const FourChannelGains& K, double dt_s, std::span<const LawInputs<1>> seen) {
      Cdob<1> cdob(K, p.g_net, p.local_model, dt_s);
      return sum_over(seen, [&](const LawInputs<1>& in) {
        cdob.step(in.local, in.received);
        return cdob.x_cdob()[0];
      });
    }};

template <int N>
class FourChannelCdob final : public Law<N> {
 public:
  static constexpr std::array kBlocks{kCdobBlock};

  FourChannelCdob(const LawParams& p, const FourChannelGains& K, double dt_s)
      : cdob_(K, p.g_net, p.local_model, dt_s) {}

  void start(const LawInputs<N>& in) noexcept override { cdob_.reset(in.received); }

  Wish<N> step(const LawInputs<N>& in) noexcept override {
    Wish<N> wish{.tell = Told<N>::motion(in.local)};
    if (!in.engaged) return wish;
    cdob_.step(in.local, in.received);
    wish.follow = {in.received.x + cdob_.x_cdob(), in.received.v + cdob_.v_cdob(), in.received.f};
    return wish;
  }

  LawSignals signals() const noexcept override { return {.x_cdob = cdob_.x_cdob()[0]}; }

 private:
  Cdob<N> cdob_;
};

}  // namespace farhand
