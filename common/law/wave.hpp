// Wave variables (common/law/wave_variables.hpp). A packet carries the angle, for aligning the sides, and the integral
// of the wave, so that the next packet makes up for a lost one.
#pragma once

#include "common/law/law.hpp"
#include "common/law/row.hpp"
#include "common/law/wave_variables.hpp"

namespace farhand {

inline constexpr std::array<std::string_view, 5> kWaveSettings{
    "control.wave_b_nms_per_rad", "control.wave_K_s_nm_per_rad", "control.wave_B_s_nms_per_rad",
    "control.wave_matching", "control.wave_drift_per_s"};

inline constexpr LawBlock kMasterWaveBlock{
    .name = "wave",
    .why = "power goes each way over a line of the impedance b",
    .without = "no wave variables cross the network",
    .bytes = sizeof(MasterWave<1>) + sizeof(ReceivedWave<1>),
    .settings = kWaveSettings,
    .run = [](const LawParams& p, const FourChannelGains& /*K*/, double dt_s, std::span<const LawInputs<1>> seen) {
      MasterWave<1> wave(p.wave);
      ReceivedWave<1> received(dt_s);
      return sum_over(seen, [&](const LawInputs<1>& in) {
        wave.step(in.local.v, received.step(in.received.f, 1, false));
        return wave.sent()[0];
      });
    }};

inline constexpr LawBlock kSlaveWaveBlock{
    .name = "wave",
    .why = kMasterWaveBlock.why,
    .without = kMasterWaveBlock.without,
    .bytes = sizeof(SlaveWave<1>) + sizeof(ReceivedWave<1>),
    .settings = kWaveSettings,
    .run = [](const LawParams& p, const FourChannelGains& /*K*/, double dt_s, std::span<const LawInputs<1>> seen) {
      SlaveWave<1> wave(p.wave, dt_s);
      ReceivedWave<1> received(dt_s);
      return sum_over(seen, [&](const LawInputs<1>& in) {
        wave.step(in.local, received.step(in.received.f, 1, false), in.received.x, 1);
        return wave.sent()[0];
      });
    }};

template <int N>
class WaveMaster final : public Law<N> {
 public:
  static constexpr std::array kBlocks{kMasterWaveBlock};

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
  static constexpr std::array kBlocks{kSlaveWaveBlock};

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
