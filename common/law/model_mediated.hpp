// Four channels on the therapist's side against a learnt model of the patient's side (common/law/mediator.hpp).
#pragma once

#include <cmath>

#include "common/law/law.hpp"
#include "common/law/mediator.hpp"
#include "common/law/row.hpp"

namespace farhand {

inline constexpr LawBlock kMediatorBlock{
    .name = "mediator",
    .why = "what the patient's side touches is felt by a model of it; the network only teaches the model",
    .without = "the slave is felt, not a model",
    .bytes = sizeof(Mediator<1>),
    .idle = Idle::kWithoutDelay,
    .instead = "FOUR_CHANNEL",
    .run = [](const LawParams& /*p*/, const FourChannelGains& K, double dt_s, std::span<const LawInputs<1>> seen) {
      Mediator<1> mediator(K, dt_s);
      if (!seen.empty()) mediator.reset(seen.front().received);
      return sum_over(seen, [&](const LawInputs<1>& in) { return mediator.step(in.local, in.received).x[0]; });
    }};

template <int N>
class ModelMediated final : public Law<N> {
 public:
  static constexpr std::array kBlocks{kMediatorBlock};
  static constexpr std::array kSignals{
      LawSignal{"friction_nm", "N m", "friction of the peer's device, as identified from its motion"},
      LawSignal{"k_rising_nm_per_rad", "N m/rad", "stiffness of what resists rising angles, as learnt"},
      LawSignal{"k_falling_nm_per_rad", "N m/rad", "stiffness of what resists falling angles, as learnt"}};

  ModelMediated(const LawParams& /*p*/, const FourChannelGains& K, double dt_s)
      : Law<N>({.previous = true}), mediator_(K, dt_s) {}

  void start(const LawInputs<N>& in) noexcept override {
    mediator_.reset(in.received);
    ahead_.setZero();
    needs_.setZero();
  }

  Wish<N> step(const LawInputs<N>& in) noexcept override {
    Wish<N> wish;
    if (in.engaged) {
      const Learns learns = in.since.settled ? Learns::kAll : in.since.rested ? Learns::kWhere : Learns::kNothing;
      const KnownFriction told =
          std::isnan(in.peer_friction) ? KnownFriction{} : KnownFriction{in.peer_friction, in.peer_friction_known};
      wish.follow = mediator_.step(in.local, in.received, learns, in.since.calm, told);
      ahead_ = wish.follow.x - in.received.x;
      needs_ = mediator_.device_needs();
    }
    wish.tell = {in.local.x, in.local.v, in.local.f - needs_};
    return wish;
  }

  LawSignals signals() const noexcept override {
    LawSignals all{.x_cdob = ahead_[0]};
    all.own[0] = mediator_.friction();
    all.own[1] = mediator_.k_rising();
    all.own[2] = mediator_.k_falling();
    return all;
  }

  // g: cut-off with which the model's contact follows from now on, rad/s.
  void settle(double g) noexcept { mediator_.settle(g); }
  double friction() const noexcept { return mediator_.friction(); }  // of the peer's device, N m
  const Joints<N>& device_needs() const noexcept { return needs_; }

 private:
  Mediator<N> mediator_;
  Joints<N> ahead_ = Joints<N>::Zero();  // rad, angle of the model minus received angle of the slave
  Joints<N> needs_ = Joints<N>::Zero();  // N m, torque that the slave's device needs beside the therapist's
};

}  // namespace farhand
