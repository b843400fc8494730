// Two channels (two_channel.hpp) with a passivity observer and controller at each port (common/law/passivity.hpp).
// They stand below the law, and lower its torque or add damping only when the energy budget is short.
#pragma once

#include "common/law/law.hpp"
#include "common/law/passivity.hpp"
#include "common/law/row.hpp"
#include "common/law/two_channel.hpp"

namespace farhand {

// The port of one side: its energy account, and the torque that the account allows.
template <int N>
class AccountedPort {
 public:
  // K_f: 1/(kg m2), of the law.
  AccountedPort(double K_f, double dt_s) : port_(kFastestDamper / K_f, dt_s) {}

  void start(const Account<N>& account) noexcept {
    port_.reset(account.received);
    tau_.setZero();
    damper_.setZero();
    slack_.setZero();
  }

  // Books the energy of the time since the last tick; called before passive() of this tick.
  void keep(const Account<N>& account) noexcept {
    if (!account.engaged) return;
    const Joints<N> within = (slack_ + account.moved).max(-0.5 * kPlay).min(0.5 * kPlay);
    const Joints<N> moved = slack_ + account.moved - within;
    slack_ = within;
    port_.step((account.acted * tau_ * moved).sum(), (account.acted * damper_ * moved).sum(), account.received);
  }

  // law: torque that the law asks for, N m.
  Wish<N> passive(const Joints<N>& law, const Motion<N>& local) noexcept {
    port_.decide((law * local.v).sum());
    damper_ = port_.damping() * local.v;
    tau_ = port_.share() * law - damper_;
    return Wish<N>::torque(tau_, local);
  }

  double energy_sent() const noexcept { return port_.in(); }
  LawSignals signals() const noexcept {
    LawSignals all;
    all.own[0] = port_.share();
    all.own[1] = port_.margin();
    return all;
  }

 private:
  // The encoder of an axis at rest may toggle by one count: that is no motion and no energy.
  static constexpr double kPlay = 0.4e-3;  // rad, more than a count of 20000

  PortPassivity port_;
  Joints<N> tau_ = Joints<N>::Zero();     // N m, torque of law and damper since the last tick
  Joints<N> damper_ = Joints<N>::Zero();  // N m, the damper's part of it
  Joints<N> slack_ = Joints<N>::Zero();   // rad, state of the play between the axis and its account
};

inline constexpr LawBlock kPortBlock{
    .name = "PO/PC",
    .why = "gives no more than the other side has taken in",
    .without = "no passivity observer counts the energy of a port",
    .bytes = sizeof(AccountedPort<1>),
    .run = [](const LawParams& /*p*/, const FourChannelGains& K, double dt_s, std::span<const LawInputs<1>> seen) {
      AccountedPort<1> port(K.K_f, dt_s);
      return sum_over(seen, [&](const LawInputs<1>& in) {
        port.keep(in.account);
        return port.passive(in.account.torque, in.local).follow.f[0];
      });
    }};

// The parts that both sides have.
template <int N>
class TwoChannelPassivity : public Law<N> {
 public:
  static constexpr std::array kSignals{
      LawSignal{"share", "1", "part of the law's torque that the controller lets through"},
      LawSignal{"energy_j", "J", "energy that the port may still give"}};

  TwoChannelPassivity(const LawParams& p, const FourChannelGains& K, double dt_s)
      : Law<N>({.account = true}), p_(p.two_channel), port_(K.K_f, dt_s) {}

  void start(const LawInputs<N>& in) noexcept override { port_.start(in.account); }
  LawSignals signals() const noexcept override { return port_.signals(); }

 protected:
  TwoChannelParams p_;
  AccountedPort<N> port_;
};

template <int N>
class PassiveMaster final : public TwoChannelPassivity<N> {
 public:
  static constexpr std::array kBlocks{kHeldToBlock, kPortBlock};

  using TwoChannelPassivity<N>::TwoChannelPassivity;

  Wish<N> step(const LawInputs<N>& in) noexcept override {
    this->port_.keep(in.account);
    Wish<N> wish;
    if (in.engaged) {
      acting_ = in.since.acting;
      const Joints<N>& F = F_.step(this->p_, in.local, in.received, in.since.silent_s);
      wish = this->port_.passive(-in.since.peers_acting * F, in.local);
    }
    wish.tell = {in.local.x, in.local.v, -acting_ * F_.value()};
    wish.energy = this->port_.energy_sent();
    return wish;
  }

 private:
  HeldTo<N> F_;
  double acting_ = 1.0;  // mean share of its torque that is given
};

template <int N>
class PassiveSlave final : public TwoChannelPassivity<N> {
 public:
  static constexpr std::array kBlocks{kGivenTorqueBlock, kPortBlock};

  using TwoChannelPassivity<N>::TwoChannelPassivity;

  Wish<N> step(const LawInputs<N>& in) noexcept override {
    this->port_.keep(in.account);
    Wish<N> wish{.tell = Told<N>::motion(in.local)};
    if (in.engaged) {
      wish = this->port_.passive(-in.since.acting * in.received.f, in.local);
      wish.follow.f += this->p_.B_slave * in.local.v;
    }
    wish.energy = this->port_.energy_sent();
    return wish;
  }
};

}  // namespace farhand
