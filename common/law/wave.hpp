// Wave variables (common/law/wave_variables.hpp). What is sent beside the angle, by which the sides align, is the
// integral of the wave: what is lost on the way is made up for by the next packet.
#pragma once

#include "common/law/law.hpp"
#include "common/law/params.hpp"
#include "common/law/wave_variables.hpp"

namespace farhand {

template <int N>
class WaveMaster final : public Law<N> {
 public:
  WaveMaster(const LawParams& p, const FourChannelGains& /*K*/, double dt_s)
      : wave_(p.wave), received_(dt_s), dt_s_(dt_s) {}

  void start(const LawInputs<N>& in) noexcept override { received_.reset(in.received.f); }

  Wish<N> step(const LawInputs<N>& in) noexcept override {
    Wish<N> wish;
    if (in.engaged) {
      wave_.step(in.local.v, received_.step(in.received.f, in.since.ticks, in.since.held));
      U_ += dt_s_ * in.since.ticks * wave_.sent();
      wish = Wish<N>::torque(-wave_.force(), in.local);
    }
    wish.tell = {in.local.x, in.local.v, U_};
    return wish;
  }

 private:
  MasterWave<N> wave_;
  ReceivedWave<N> received_;
  double dt_s_;
  Joints<N> U_ = Joints<N>::Zero();  // integral of u_m, sqrt(W) s
};

template <int N>
class WaveSlave final : public Law<N> {
 public:
  WaveSlave(const LawParams& p, const FourChannelGains& /*K*/, double dt_s)
      : wave_(p.wave, dt_s), received_(dt_s), dt_s_(dt_s) {}

  void start(const LawInputs<N>& in) noexcept override {
    received_.reset(in.received.f);
    wave_.reset(in.local.x);
  }

  Wish<N> step(const LawInputs<N>& in) noexcept override {
    Wish<N> wish;
    if (in.engaged) {
      const Joints<N>& u = received_.step(in.received.f, in.since.ticks, in.since.held);
      wave_.step(in.local, u, in.received.x, in.since.ticks);
      U_ += dt_s_ * in.since.ticks * wave_.sent();
      wish = Wish<N>::torque(wave_.force(), in.local);
    }
    wish.tell = {in.local.x, in.local.v, U_};
    return wish;
  }

 private:
  SlaveWave<N> wave_;
  ReceivedWave<N> received_;
  double dt_s_;
  Joints<N> U_ = Joints<N>::Zero();  // integral of u_s, sqrt(W) s
};

}  // namespace farhand
