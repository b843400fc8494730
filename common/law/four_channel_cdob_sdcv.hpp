// Four channels with CDOB and a scaling-down compensation value, which reduces the compensation in contact (Daud 2011,
// figure 5.11). Its thresholds are those of the scene, or are estimated from the patient's own hand.
#pragma once

#include <cstddef>
#include <optional>

#include "common/law/cdob.hpp"
#include "common/law/four_channel_cdob.hpp"
#include "common/law/law.hpp"
#include "common/law/patient_thresholds.hpp"
#include "common/law/row.hpp"
#include "common/law/sdcv.hpp"

namespace farhand {

inline constexpr LawBlock kSdcvBlock{
    .name = "SDCV",
    .why = "takes the compensation back in contact",
    .without = "nothing takes a compensation back in contact",
    .bytes = sizeof(Sdcv<1>),
    .settings = {"control.f_1_nm", "control.f_2_nm", "control.alpha_cutoff_rad_s"},
    .idle = Idle::kWithoutContact,
    .touch = "control.f_1_nm",
    .instead = "FOUR_CHANNEL_CDOB",
    .run = [](const LawParams& p, const FourChannelGains& /*K*/, double dt_s, std::span<const LawInputs<1>> seen) {
      Sdcv<1> sdcv(p.sdcv, dt_s);
      return sum_over(seen, [&](const LawInputs<1>& in) { return sdcv.step(in.received.f)[0]; });
    }};

inline constexpr LawBlock kPatientThresholdsBlock{
    .name = "patient's thresholds",
    .why = "identifies f_1 and f_2 from the patient's own hand",
    .without = "no thresholds are identified from the patient",
    .bytes = sizeof(std::optional<PatientsThresholds<1>>),
    .asked_by = "control.sdcv_from_patient",
    .run = [](const LawParams& p, const FourChannelGains& /*K*/, double dt_s, std::span<const LawInputs<1>> seen) {
      PatientsThresholds<1> patient = patients_thresholds<1>(p.sdcv, dt_s);
      return sum_over(seen, [&](const LawInputs<1>& in) {
        patient.front().step(in.received.x[0], in.received.f[0]);
        return patient.front().f_2();
      });
    }};

template <int N>
class FourChannelCdobSdcv final : public Law<N> {
 public:
  static constexpr std::array kBlocks{kCdobBlock, kSdcvBlock, kPatientThresholdsBlock};
  static constexpr std::array kSignals{
      LawSignal{"f_2_nm", "N m", "f_2 as identified from the patient, in the master's size; 0 until it is"}};

  FourChannelCdobSdcv(const LawParams& p, const FourChannelGains& K, double dt_s)
      : cdob_(K, p.g_net, p.local_model, dt_s), sdcv_(p.sdcv, dt_s) {
    if (p.sdcv.from_patient) patient_ = patients_thresholds<N>(p.sdcv, dt_s);
  }

  void start(const LawInputs<N>& in) noexcept override {
    cdob_.reset(in.received);
    sdcv_.reset(in.received.f);
    if (!patient_) return;
    for (PatientThresholds& joint : *patient_) joint.reset();
  }

  Wish<N> step(const LawInputs<N>& in) noexcept override {
    Wish<N> wish{.tell = Told<N>::motion(in.local)};
    if (!in.engaged) return wish;
    const Motion<N>& received = in.received;
    cdob_.step(in.local, received);
    for (int j = 0; patient_ && j < N; ++j) {
      PatientThresholds& joint = (*patient_)[static_cast<std::size_t>(j)];
      if (in.since.settled) joint.step(received.x[j], received.f[j]);
      sdcv_.set_thresholds(j, joint.f_1(), joint.f_2());
    }
    const Joints<N>& alpha = sdcv_.step(received.f);
    wish.follow = {received.x + alpha * cdob_.x_cdob(), received.v + alpha * cdob_.v_cdob(), received.f};
    return wish;
  }

  LawSignals signals() const noexcept override {
    LawSignals all{.x_cdob = cdob_.x_cdob()[0], .alpha = sdcv_.value()[0]};
    if (patient_) all.own[0] = patient_->front().named();
    return all;
  }

 private:
  Cdob<N> cdob_;
  Sdcv<N> sdcv_;
  std::optional<PatientsThresholds<N>> patient_;
};

}  // namespace farhand
