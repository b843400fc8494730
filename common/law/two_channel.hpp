// Two channels, position one way and force the other (Daud 2011, 4.4.1, 5.3.1). The master is held to where the slave
// was; the slave gives the torque that this took. Stable over short delays only: the one loop goes through both.
//
//   tau_m = -F,   F = K_2 (x_m - x_s^d) + B_2 (v_m - v_s^d)          tau_s = F^d - B_slave v_s
//
// While nothing newer comes the slave is taken to stand where it was last, and a therapist who goes on would be held
// there: what a word that is old gives him never grows. Where a host stops and its drive lets go, again and again, the
// therapist pushes through, or the slave stands back, and F grows: so the slave is told what was given here on an
// average, and the therapist feels what counts of a slave that was let go of. A slave whose own drive lets go gives
// less, too: its hand swings, and would be met by all of it (tests/gaps_test.cpp).
#pragma once

#include <utility>

#include "common/law/law.hpp"
#include "common/law/row.hpp"

namespace farhand {

// What the master gives against the therapist, N m. Positive where the master is ahead of the slave.
template <int N>
Joints<N> held_to(const TwoChannelParams& p, const Motion<N>& local, const Motion<N>& received) noexcept {
  return p.K_2 * (local.x - received.x) + p.B_2 * (local.v - received.v);
}

template <int N>
class HeldTo {
 public:
  // silent_s: since something newer of the slave was shown. Same sign as held_to().
  const Joints<N>& step(const TwoChannelParams& p, const Motion<N>& local, const Motion<N>& received,
                        double silent_s) noexcept {
    const bool old = silent_s > kOld;
    const Joints<N> F = held_to(p, local, received);
    if (!std::exchange(old_, old)) most_ = F_.abs();
    F_ = old ? Joints<N>(F.max(-most_).min(most_)) : F;
    return F_;
  }
  void reset() noexcept {
    F_.setZero();
    old_ = false;
  }
  const Joints<N>& value() const noexcept { return F_; }

 private:
  static constexpr double kOld = 5.5e-3;  // s
  Joints<N> F_ = Joints<N>::Zero(), most_ = Joints<N>::Zero();
  bool old_ = false;
};

inline constexpr LawBlock kHeldToBlock{
    .name = "two channels",
    .why = "held to where the slave was",
    .without = "force is not what comes of positions alone",
    .bytes = sizeof(TwoChannelParams) + sizeof(HeldTo<1>),
    .settings = {"control.K_2_nm_per_rad", "control.B_2_nms_per_rad", "control.B_slave_nms_per_rad"},
    .run = [](const LawParams& p, const FourChannelGains& /*K*/, double /*dt_s*/, std::span<const LawInputs<1>> seen) {
      HeldTo<1> held;
      return sum_over(seen, [&](const LawInputs<1>& in) {
        return held.step(p.two_channel, in.local, in.received, in.since.silent_s)[0];
      });
    }};

inline constexpr LawBlock kGivenTorqueBlock{
    .name = "two channels",
    .why = "gives the torque that holding took, less a damper",
    .without = kHeldToBlock.without,
    .bytes = sizeof(TwoChannelParams),
    .settings = kHeldToBlock.settings,
    .run = [](const LawParams& p, const FourChannelGains& /*K*/, double /*dt_s*/, std::span<const LawInputs<1>> seen) {
      return sum_over(
          seen, [&](const LawInputs<1>& in) { return -in.received.f[0] - p.two_channel.B_slave * in.local.v[0]; });
    }};

template <int N>
class TwoChannelMaster final : public Law<N> {
 public:
  static constexpr std::array kBlocks{kHeldToBlock};

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
  static constexpr std::array kBlocks{kGivenTorqueBlock};

  TwoChannelSlave(const LawParams& p, const FourChannelGains& /*K*/, double /*dt_s*/) : p_(p.two_channel) {}

  void start(const LawInputs<N>& /*in*/) noexcept override {}

  Wish<N> step(const LawInputs<N>& in) noexcept override {
    return Wish<N>::torque(-in.since.acting * in.received.f - p_.B_slave * in.local.v, in.local);
  }

 private:
  TwoChannelParams p_;
};

}  // namespace farhand
