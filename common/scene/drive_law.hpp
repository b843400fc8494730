// What a direct drive does: included where it is compiled, and by what wants it for another number of joints.
#pragma once

#include "common/control/four_channel.hpp"
#include "common/scene/drive.hpp"

namespace farhand {

template <int N>
void DirectDrive<N>::reset(const Sensed& sensed) noexcept {
  derivative_.reset(sensed.x);
  stuck_.reset();
  unseen_ = 0;
  bound_.reset();
  dob_.reset(Joints<N>::Zero(), Joints<N>::Zero());
  rtob_.reset(-model_.gravity_load<N>(sensed.x), Joints<N>::Zero());
}

template <int N>
Motion<N> DirectDrive<N>::observe(const Sensed& sensed, int ticks) noexcept {
  const Dob<N>& known = stuck_.stood() > 0 ? moving_.dob : dob_;
  const Joints<N> a = (gate_.applied() - known.value()) / model_.J_n;
  if (stuck_.step(sensed.x, derivative_.value(), a, ticks)) moving_ = {derivative_, dob_, rtob_};
  if (stuck_.stuck(limits_ != 0)) {
    derivative_ = moving_.derivative;
    dob_ = moving_.dob;
    rtob_ = moving_.rtob;
    unseen_ = stuck_.stood();
    return {sensed.x, stuck_.v(), rtob_.value()};
  }
  if (const int unseen = std::exchange(unseen_, 0)) return along(sensed.x, unseen + ticks);
  Motion<N> local;
  local.x = sensed.x;
  local.v = ticks > 1 ? derivative_.bridge(sensed.x) : derivative_.step(sensed.x);
  dob_.step(gate_.applied(), local.v);
  local.f = rtob_.step(gate_.applied(), local.x, local.v);
  return local;
}

template <int N>
Motion<N> DirectDrive<N>::along(const Joints<N>& x, int ticks) noexcept {
  const Joints<N> from = derivative_.last();
  Motion<N> local;
  local.x = x;
  for (int k = 1; k <= ticks; ++k) {
    const Joints<N> at = from + (x - from) * (k / static_cast<double>(ticks));
    local.v = derivative_.step(at);
    dob_.step(gate_.applied(), local.v);
    local.f = rtob_.step(gate_.applied(), at, local.v);
  }
  return local;
}

template <int N>
auto DirectDrive<N>::follow(const Motion<N>& local, const Motion<N>& target, bool driven, int ticks) noexcept
    -> Command {
  authority_ = std::clamp(authority_ + (driven ? rise_ : -fall_) * ticks, 0.0, 1.0);
  const Joints<N> asked = four_channel(K_, local, target);
  const Joints<N> a_ref = bound_.step(asked, local, gate_.applied(), dob_.value());
  limits_ = driven ? bound_.active() : 0u;
  const Joints<N> wish = model_.J_n * a_ref + dob_.value();
  // An axis without weight pays nothing for it: 0 + a (wish - 0) would be the same number, later.
  if (model_.gravity == 0.0) return {gate_.pass(authority_ * wish, local.x)};
  const Joints<N>& idle = rtob_.gravity_load();
  return {gate_.pass(idle + authority_ * (wish - idle), local.x)};
}

template <int N>
auto DirectDrive<N>::safe() noexcept -> Command {
  authority_ = 0.0;
  limits_ = 0;
  return {gate_.cut()};
}

}  // namespace farhand
