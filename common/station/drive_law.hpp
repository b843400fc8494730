// The code of the direct drive. It is included where it is compiled, and by code for another number of joints.
#pragma once

#include "common/law/acceleration_law.hpp"
#include "common/station/drive.hpp"

namespace farhand {

template <int N>
void DirectDrive<N>::reset(const Sensed& sensed) noexcept {
  speed_.reset(sensed.x);
  stuck_.reset();
  unseen_ = 0;
  bound_.reset();
  dob_.reset(Joints<N>::Zero(), Joints<N>::Zero());
  rtob_.reset(-model_.gravity_load<N>(sensed.x), Joints<N>::Zero());
}

template <int N>
Motion<N> DirectDrive<N>::observe(const Sensed& sensed, int ticks) noexcept {
  if (ticks > 1) {
    stuck_.reset();
    return across(sensed.x, std::exchange(unseen_, 0), ticks);
  }
  acted_ = gate_.applied();
  acted_share_ = 1.0;
  const Dob<N>& known = stuck_.stood() > 0 ? moving_.dob : dob_;
  if (stuck_.step(sensed.x, speed_.for_guards(), (acted_ - known.value()) / model_.J_n))
    moving_ = {speed_, dob_, rtob_, acted_};
  if (stuck_.stuck(limits_ != 0)) {
    speed_ = moving_.speed;
    dob_ = moving_.dob;
    rtob_ = moving_.rtob;
    unseen_ = stuck_.stood();
    return {sensed.x, stuck_.v(), rtob_.value()};
  }
  if (const int unseen = std::exchange(unseen_, 0)) return across(sensed.x, unseen, 1);
  return estimate(sensed.x, acted_);
}

template <int N>
Motion<N> DirectDrive<N>::estimate(const Joints<N>& x, const Joints<N>& tau) noexcept {
  Motion<N> local;
  local.x = x;
  local.v = speed_.step(x);
  dob_.step(tau, local.v);
  local.f = rtob_.step(tau, local.x, local.v);
  return local;
}

// Runs the observers tick by tick on the straight line between the two readings, with the torque that the drive gave
// meanwhile: the result is that of an axis that moved evenly. The velocity is that of the whole gap. It is less noisy
// than that of one tick, and the observers do not take a step of it for a torque.
template <int N>
Motion<N> DirectDrive<N>::across(const Joints<N>& x, int unseen, int ticks) noexcept {
  const int all = unseen + ticks;
  if (all > kLongestGap) {
    gate_.cut();
    reset({.x = x});
    acted_.setZero();
    acted_share_ = 0.0;
    return estimate(x, acted_);
  }
  const Joints<N> from = speed_.last(), given = gate_.applied();
  Motion<N> local;
  acted_share_ = 0.0;
  for (int k = 1; k <= all; ++k) {
    const bool missed = ticks > 1 && k > unseen;  // no command was given in this tick
    const double share = missed ? power_stage_.share((k - unseen - 0.5) * dt_s_) : 1.0;
    if (k > unseen) acted_share_ += share / ticks;
    local = estimate(k < all ? Joints<N>(from + (x - from) * (k / static_cast<double>(all))) : x, given * share);
  }
  acted_ = given * acted_share_;
  if (ticks > 1) gate_.decayed(power_stage_.share(ticks * dt_s_));
  return local;
}

// While the axis is slow, it takes some ticks to tell a frozen encoder from a stop. If the axis did stop, torque that
// pushes it on may come a few ms later without harm. If it did not, torque that compensates the apparent stop would
// drive it over the limit that it is near.
template <int N>
Joints<N> DirectDrive<N>::doubted(Joints<N> wish) const noexcept {
  const Joints<N> moved = stuck_.moved();
  for (int i = 0; i < N; ++i) {
    const double most = std::max({moved[i] * moving_.torque[i], moved[i] * moving_.dob.value()[i], 0.0});
    if (moved[i] * wish[i] > most && moved[i] != 0.0) wish[i] = moved[i] * most;
  }
  return wish;
}

template <int N>
auto DirectDrive<N>::follow(const Motion<N>& local, const Motion<N>& target, Wanted wanted, int ticks) noexcept
    -> Command {
  authority_ = std::clamp(authority_ + (wanted.driven ? rise_ : -fall_) * ticks, 0.0, 1.0);
  const Joints<N> asked = four_channel(K_, local, target);
  const Motion<N> seen = speed_.two() ? for_guards(local) : local;
  const Joints<N> a_ref = bound_.step(asked, seen, gate_.applied(), dob_.value());
  const std::uint32_t limits_before = std::exchange(limits_, wanted.driven ? bound_.active() : 0u);
  const Joints<N> free = model_.J_n * a_ref + dob_.value();
  const Joints<N> wish = (limits_before | (stuck_.stood() > 1 ? limits_ : 0u)) != 0 ? doubted(free) : free;
  // Shortcut for an axis without weight: 0 + a (wish - 0) is the same number, but takes longer to compute.
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
