// Two channels, position one way and force the other (Daud 2011, 4.4.1, 5.3.1). A spring and a damper hold the master
// to the delayed position of the slave; the slave applies the torque of that spring. It is stable over short delays
// only, because its single loop passes through both directions of the network.
//
//   tau_m = -F,   F = K_2 (x_m - x_s^d) + B_2 (v_m - v_s^d)          tau_s = F^d - B_slave v_s
//
// While no newer packet comes, the slave is assumed to stand at its last position, and a therapist who moves on would
// be held there: therefore the torque from an old position never grows. If a host stops again and again and its drive
// lets go, the therapist pushes through, or the slave stays behind, and F grows. Therefore the slave is sent the mean
// torque that was really applied here, and the therapist feels the torque reduced by the share of time in which the
// slave's drive acted. A slave whose own drive let go applies less torque, too, because its hand swings and would meet
// the full torque (tests/gaps_test.cpp).
#pragma once

#include <utility>

#include "common/law/law.hpp"
#include "common/law/row.hpp"

namespace farhand {

// Torque of the master against the therapist, N m. Positive if the master is ahead of the slave.
template <int N>
Joints<N> held_to(const TwoChannelParams& p, const Motion<N>& local, const Motion<N>& received) noexcept {
  return p.K_2 * (local.x - received.x) + p.B_2 * (local.v - received.v);
}

template <int N>
class HeldTo {
 public:
  // silent_s: time since a newer motion of the slave was shown. Same sign as held_to().
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
    .without = "no side is held to the other's position alone",
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
  double acting_ = 1.0;  // mean share of its torque that is given
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
