// Four channels over energy tanks, by which a person receives no more energy than came from the other person. The tanks
// stand below the law, on both sides. They change the motion to follow only when the energy budget is short, by a share
// g of the law and a damper d,
//
//   a_ref = g C_p (x_remote - x) - K_f (f + g f_remote + d v)
//
// which is K_f (g tau - d v - f) for a law that asks for the torque tau. Packets also carry the energy sent.
#pragma once

#include "common/law/energy_tank.hpp"
#include "common/law/law.hpp"
#include "common/law/row.hpp"
#include "common/signal/low_pass.hpp"

namespace farhand {

inline constexpr LawBlock kTankBlock{
    .name = "energy tank",
    .why = "gives no more than it holds",
    .without = "no tank keeps account of energy",
    .bytes = sizeof(EnergyTank),
    .settings = {"control.tank_level_j", "control.tank_alpha_nms_per_rad_j", "control.tank_rate_per_s",
                 "control.tank_B_fast_nms_per_rad"},
    .run = [](const LawParams& p, const FourChannelGains& K, double dt_s, std::span<const LawInputs<1>> seen) {
      EnergyTank tank(p.tank, kFastestDamper / K.K_f, dt_s);
      return sum_over(seen, [&](const LawInputs<1>& in) {
        tank.step((in.account.torque * in.account.moved).sum(), in.account.received, 1);
        return tank.share() + tank.damping();
      });
    }};

template <int N>
class FourChannelTank final : public Law<N> {
 public:
  static constexpr std::array kBlocks{kTankBlock};
  static constexpr std::array kSignals{LawSignal{"share", "1", "part of the law's torque that the tank allows"},
                                       LawSignal{"energy_j", "J", "energy in the tank"}};

  FourChannelTank(const LawParams& p, const FourChannelGains& K, double dt_s)
      : Law<N>({.account = true}),
        tank_(p.tank, kFastestDamper / K.K_f, dt_s),
        v_slow_(Cutoff::rad_s(kOnPurpose), dt_s),
        B_fast_(p.tank.B_fast) {}

  void start(const LawInputs<N>& in) noexcept override { v_slow_.reset(in.local.v); }

  Wish<N> step(const LawInputs<N>& in) noexcept override {
    const Account<N>& account = in.account;
    if (account.engaged) {
      tank_.step((account.torque * account.moved).sum(), account.received, in.since.ticks);
    } else {
      tank_.lend(account.received, in.since.ticks);
    }
    Wish<N> wish{.tell = Told<N>::motion(in.local), .energy = tank_.sent()};
    if (in.engaged) wish.follow = within(in.local, in.received);
    return wish;
  }

  LawSignals signals() const noexcept override {
    LawSignals all;
    all.own[0] = tank_.share();
    all.own[1] = tank_.level();
    return all;
  }

 private:
  Motion<N> within(const Motion<N>& local, const Motion<N>& received) noexcept {
    const Joints<N> v_fast = local.v - v_slow_.step(local.v);
    const double g = tank_.share();
    Motion<N> to = g < 1.0 ? shared(local, received, g) : received;
    to.f += tank_.damping() * local.v + B_fast_ * v_fast;
    return to;
  }
  static Motion<N> shared(const Motion<N>& local, const Motion<N>& received, double share) noexcept {
    const Joints<N> g = Joints<N>::Constant(share);
    return {local.x + g * (received.x - local.x), local.v + g * (received.v - local.v), g * received.f};
  }

  EnergyTank tank_;
  LowPass<N> v_slow_;
  double B_fast_;
};

}  // namespace farhand
