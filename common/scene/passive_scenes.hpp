// Four channels that give a person no more energy than came from the other one: by tanks, or by passivity observers and
// controllers. Both stand below the law, on both sides, and change the motion that is followed only where energy is
// short; then by a share g of the law and a damper d,
//
//   a_ref = g C_p (x_remote - x) - K_f (f + g f_remote + d v)
//
// which is K_f (g tau - d v - f) for a law that asks for the torque tau. What packets carry besides is one number.
#pragma once

#include "common/control/energy_tank.hpp"
#include "common/control/passivity.hpp"
#include "common/scene/drive.hpp"
#include "common/scene/tick_trace.hpp"
#include "common/scene/torque_scenes.hpp"
#include "common/signal/low_pass.hpp"

namespace farhand {

// What a station tells such a scene once per tick, before the law.
template <int N>
struct Account {
  Joints<N> torque;  // that acted on the axis since the last tick, without what carries its weight
  double acted;      // of the torque that the law asked for last: 1, less across a gap
  Joints<N> moved;   // rad, in that time
  double received;   // J, what the peer has told of so far
  bool engaged;      // in that time
  int ticks;
};

// 1/s, of a damper with the inertia 1/K_f: the velocity is known 7 ms late.
inline constexpr double kFastestDamper = 100.0;

template <class D>
struct FourChannelTank {
  using Drive = D;
  static constexpr int N = D::kJoints;
  explicit FourChannelTank(const SceneParams& p)
      : drive(p.drive),
        tank(p.tank, kFastestDamper / p.drive.K.K_f, p.drive.dt_s),
        v_slow(Cutoff::rad_s(kOnPurpose), p.drive.dt_s),
        B_fast(p.tank.B_fast) {}

  Drive drive;
  EnergyTank tank;
  LowPass<N> v_slow;
  double B_fast;

  void start(const Motion<N>& local, const Motion<N>& /*received*/) noexcept { v_slow.reset(local.v); }
  void keep(const Account<N>& account) noexcept;
  Motion<N> target(const Motion<N>& local, const Motion<N>& received, Elapsed since) noexcept;
  double energy_sent() const noexcept { return tank.sent(); }
  double energy() const noexcept { return tank.level(); }
  Compensation compensation() const noexcept { return {0.0, tank.share()}; }
};

// Two channels (common/control/two_channel.hpp) with a passivity observer and controller at each port.
template <class D>
struct TwoChannelPassivity {
  using Drive = D;
  static constexpr int N = D::kJoints;
  explicit TwoChannelPassivity(const SceneParams& p)
      : drive(p.drive), params(p.two_channel), port(kFastestDamper / p.drive.K.K_f, p.drive.dt_s) {}

  Drive drive;
  TwoChannelParams params;
  PortPassivity port;
  Joints<N> tau = Joints<N>::Zero();     // N m, of the law and the damper since the last tick
  Joints<N> damper = Joints<N>::Zero();  // N m, of it, against the motion
  Joints<N> slack = Joints<N>::Zero();   // rad, of the play through which the axis moves the account
  double told = 0.0;                     // J, by the peer so far

  void start(const Motion<N>& /*local*/, const Motion<N>& /*received*/) noexcept {
    port.reset(told);
    tau.setZero();
    damper.setZero();
    slack.setZero();
  }
  // Resting, an encoder shows its last count now and again: no motion, and no energy.
  static constexpr double kPlay = 0.4e-3;  // rad, more than a count of 20000
  void keep(const Account<N>& account) noexcept;
  // law: the torque that is asked for, N m.
  Motion<N> passive(const Joints<N>& law, const Motion<N>& local) noexcept;
  double energy_sent() const noexcept { return port.in(); }
  double energy() const noexcept { return port.margin(); }
  Compensation compensation() const noexcept { return {0.0, port.share()}; }
};

template <class D>
struct PassiveMaster : TwoChannelPassivity<D> {
  using Base = TwoChannelPassivity<D>;
  using Base::Base;
  static constexpr int N = D::kJoints;
  HeldTo<N> F;
  double acting = 1.0;  // of it, what is given on an average
  Motion<N> target(const Motion<N>& local, const Motion<N>& received, Elapsed since) noexcept {
    acting = since.acting;
    return this->passive(-since.peers_acting * F.step(this->params, local, received, since.silent_s), local);
  }
  Motion<N> outgoing(const Motion<N>& local) const noexcept { return {local.x, local.v, -acting * F.value()}; }
};

template <class D>
struct PassiveSlave : TwoChannelPassivity<D> {
  using Base = TwoChannelPassivity<D>;
  using Base::Base;
  static constexpr int N = D::kJoints;
  Motion<N> target(const Motion<N>& local, const Motion<N>& received, Elapsed since) noexcept {
    Motion<N> to = this->passive(-since.acting * received.f, local);
    to.f += this->params.B_slave * local.v;
    return to;
  }
};

template <int N>
Motion<N> shared(const Motion<N>& local, const Motion<N>& received, const Joints<N>& g) noexcept {
  return {local.x + g * (received.x - local.x), local.v + g * (received.v - local.v), g * received.f};
}

template <class D>
void FourChannelTank<D>::keep(const Account<N>& account) noexcept {
  if (account.engaged) {
    tank.step((account.torque * account.moved).sum(), account.received, account.ticks);
  } else {
    tank.lend(account.received, account.ticks);
  }
}

template <class D>
auto FourChannelTank<D>::target(const Motion<N>& local, const Motion<N>& received, Elapsed) noexcept -> Motion<N> {
  const Joints<N> v_fast = local.v - v_slow.step(local.v);
  const double g = tank.share();
  Motion<N> to = g < 1.0 ? shared<N>(local, received, Joints<N>::Constant(g)) : received;
  to.f += tank.damping() * local.v + B_fast * v_fast;
  return to;
}

template <class D>
void TwoChannelPassivity<D>::keep(const Account<N>& account) noexcept {
  told = account.received;
  if (!account.engaged) return;
  const Joints<N> within = (slack + account.moved).max(-0.5 * kPlay).min(0.5 * kPlay);
  const Joints<N> moved = slack + account.moved - within;
  slack = within;
  port.step((account.acted * tau * moved).sum(), (account.acted * damper * moved).sum(), told);
}

template <class D>
auto TwoChannelPassivity<D>::passive(const Joints<N>& law, const Motion<N>& local) noexcept -> Motion<N> {
  port.decide((law * local.v).sum());
  damper = port.damping() * local.v;
  tau = port.share() * law - damper;
  return asks_for(drive, tau, local);
}

// Compiled once, in passive_scenes.cpp.
extern template struct FourChannelTank<DirectDrive<1>>;
extern template struct FourChannelTank<ReferenceDrive<1>>;
extern template struct PassiveMaster<DirectDrive<1>>;
extern template struct PassiveMaster<ReferenceDrive<1>>;
extern template struct PassiveSlave<DirectDrive<1>>;
extern template struct PassiveSlave<ReferenceDrive<1>>;

}  // namespace farhand
