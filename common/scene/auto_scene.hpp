// Four channels on the therapist's side that choose by the network: common/control/chooser.hpp.
#pragma once

#include "common/control/chooser.hpp"
#include "common/scene/four_channel.hpp"

namespace farhand {

template <class D>
struct FourChannelAuto : FourChannelMediated<D> {
  using Base = FourChannelMediated<D>;
  static constexpr int N = D::kJoints;
  explicit FourChannelAuto(const SceneParams& p) : Base(p), chooser(p.drive.dt_s) {}

  Chooser chooser;

  void network(const NetworkNow& now, int ticks) noexcept {
    chooser.step(now, ticks);
    this->mediator.settle(chooser.settle());
  }
  const Chosen& chosen() const noexcept { return chooser.chosen(); }

  Motion<N> target(const Motion<N>& local, const Motion<N>& received, Elapsed since) noexcept;
  Motion<N> outgoing(const Motion<N>& local) const noexcept {
    return {local.x, local.v, local.f - chooser.share() * this->needs};
  }
  Compensation compensation() const noexcept { return {chooser.share() * this->ahead[0], chooser.share()}; }
};

template <class D>
auto FourChannelAuto<D>::target(const Motion<N>& local, const Motion<N>& received, Elapsed since) noexcept
    -> Motion<N> {
  const Motion<N> model = Base::target(local, received, since);
  const double g = chooser.share();
  return {received.x + g * (model.x - received.x), received.v + g * (model.v - received.v),
          received.f + g * (model.f - received.f)};
}

// Compiled once, in auto_scene.cpp.
extern template struct FourChannelAuto<DirectDrive<1>>;
extern template struct FourChannelAuto<ReferenceDrive<1>>;

}  // namespace farhand
