// Two channels, position one way and force the other (common/control/two_channel.hpp).
#pragma once

#include "common/control/two_channel.hpp"
#include "common/law/law.hpp"
#include "common/law/params.hpp"

namespace farhand {

template <int N>
class TwoChannelMaster final : public Law<N> {
 public:
  TwoChannelMaster(const LawParams& p, const FourChannelGains& /*K*/, double /*dt_s*/) : p_(p.two_channel) {}

  void start(const LawInputs<N>& /*in*/) noexcept override { F_.reset(); }

  Wish<N> step(const LawInputs<N>& in) noexcept override {
    Wish<N> wish;
    if (in.engaged) {
      acting_ = in.since.acting;
      const Joints<N>& F = F_.step(p_, in.local, in.received, in.since.silent_s);
      wish = Wish<N>::torque(-in.since.peers_acting * F, in.local);
    }
    wish.tell = {in.local.x, in.local.v, -acting_ * F_.value()};
    return wish;
  }

 private:
  TwoChannelParams p_;
  HeldTo<N> F_;
  double acting_ = 1.0;  // of it, what is given on an average
};

template <int N>
class TwoChannelSlave final : public Law<N> {
 public:
  TwoChannelSlave(const LawParams& p, const FourChannelGains& /*K*/, double /*dt_s*/) : p_(p.two_channel) {}

  void start(const LawInputs<N>& /*in*/) noexcept override {}

  Wish<N> step(const LawInputs<N>& in) noexcept override {
    return Wish<N>::torque(-in.since.acting * in.received.f - p_.B_slave * in.local.v, in.local);
  }

 private:
  TwoChannelParams p_;
};

}  // namespace farhand
