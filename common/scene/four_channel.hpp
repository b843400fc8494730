// The scenes of the four-channel family: which blocks, in which order. What a scene does not need is not in its struct.
//
// A scene turns the local motion and the motion received from the peer into the motion to follow; its drive does the
// rest. The slave of every architecture here is the plain FourChannel; the compensations stand on the therapist's side
// (Daud 2011, figures 5.9-5.11).
#pragma once

#include <cstddef>
#include <optional>

#include "common/control/cdob.hpp"
#include "common/control/mediator.hpp"
#include "common/control/patient_thresholds.hpp"
#include "common/control/sdcv.hpp"
#include "common/scene/drive.hpp"
#include "common/scene/tick_trace.hpp"

namespace farhand {

template <class D>
struct FourChannel {
  using Drive = D;
  static constexpr int N = D::kJoints;
  explicit FourChannel(const SceneParams& p) : drive(p.drive) {}

  Drive drive;

  void start(const Motion<N>& /*local*/, const Motion<N>& /*received*/) noexcept {}
  Motion<N> target(const Motion<N>& /*local*/, const Motion<N>& received, Elapsed /*since*/) noexcept {
    return received;
  }
  Compensation compensation() const noexcept { return {}; }
};

template <class D>
struct FourChannelCdob {
  using Drive = D;
  static constexpr int N = D::kJoints;
  explicit FourChannelCdob(const SceneParams& p)
      : drive(p.drive), cdob(p.drive.K, p.g_net, p.local_model, p.drive.dt_s) {}

  Drive drive;
  Cdob<N> cdob;

  void start(const Motion<N>& /*local*/, const Motion<N>& received) noexcept;
  Motion<N> target(const Motion<N>& local, const Motion<N>& received, Elapsed /*since*/) noexcept;
  Compensation compensation() const noexcept { return {cdob.x_cdob()[0], 1.0}; }
};

template <class D>
struct FourChannelCdobSdcv {
  using Drive = D;
  static constexpr int N = D::kJoints;
  explicit FourChannelCdobSdcv(const SceneParams& p)
      : drive(p.drive), cdob(p.drive.K, p.g_net, p.local_model, p.drive.dt_s), sdcv(p.sdcv, p.drive.dt_s) {
    if (p.sdcv.from_patient) patient = patients_thresholds<N>(p.sdcv, p.drive.dt_s);
  }

  Drive drive;
  Cdob<N> cdob;
  Sdcv<N> sdcv;
  std::optional<PatientsThresholds<N>> patient;

  void start(const Motion<N>& /*local*/, const Motion<N>& received) noexcept;
  Motion<N> target(const Motion<N>& local, const Motion<N>& received, Elapsed /*since*/) noexcept;
  Compensation compensation() const noexcept;
};

template <class D>
struct FourChannelMediated {
  using Drive = D;
  static constexpr int N = D::kJoints;
  explicit FourChannelMediated(const SceneParams& p) : drive(p.drive), mediator(p.drive.K, p.drive.dt_s) {}

  Drive drive;
  Mediator<N> mediator;
  Joints<N> ahead = Joints<N>::Zero();  // the model, of the slave as received
  Joints<N> needs = Joints<N>::Zero();  // N m, of the slave's device beside what the therapist gives

  void start(const Motion<N>& /*local*/, const Motion<N>& received) noexcept;
  Motion<N> target(const Motion<N>& local, const Motion<N>& received, Elapsed /*since*/) noexcept;
  Motion<N> outgoing(const Motion<N>& local) const noexcept { return {local.x, local.v, local.f - needs}; }
  Compensation compensation() const noexcept { return {ahead[0], 1.0}; }
  double friction() const noexcept { return mediator.friction_named(); }
};

template <class D>
void FourChannelCdob<D>::start(const Motion<N>&, const Motion<N>& received) noexcept {
  cdob.reset(received);
}

template <class D>
auto FourChannelCdob<D>::target(const Motion<N>& local, const Motion<N>& received, Elapsed) noexcept -> Motion<N> {
  cdob.step(local, received);
  return {received.x + cdob.x_cdob(), received.v + cdob.v_cdob(), received.f};
}

template <class D>
void FourChannelCdobSdcv<D>::start(const Motion<N>&, const Motion<N>& received) noexcept {
  cdob.reset(received);
  sdcv.reset(received.f);
  if (!patient) return;
  for (PatientThresholds& joint : *patient) joint.reset();
}

template <class D>
auto FourChannelCdobSdcv<D>::target(const Motion<N>& local, const Motion<N>& received, Elapsed since) noexcept
    -> Motion<N> {
  cdob.step(local, received);
  for (int j = 0; patient && j < N; ++j) {
    PatientThresholds& joint = (*patient)[static_cast<std::size_t>(j)];
    if (since.settled) joint.step(received.x[j], received.f[j]);
    sdcv.set_thresholds(j, joint.f_1(), joint.f_2());
  }
  const Joints<N>& alpha = sdcv.step(received.f);
  return {received.x + alpha * cdob.x_cdob(), received.v + alpha * cdob.v_cdob(), received.f};
}

template <class D>
Compensation FourChannelCdobSdcv<D>::compensation() const noexcept {
  Compensation all{cdob.x_cdob()[0], sdcv.value()[0]};
  if (patient) all.f_2 = patient->front().named();
  return all;
}

template <class D>
void FourChannelMediated<D>::start(const Motion<N>&, const Motion<N>& received) noexcept {
  mediator.reset(received);
  ahead.setZero();
  needs.setZero();
}

template <class D>
auto FourChannelMediated<D>::target(const Motion<N>& local, const Motion<N>& received, Elapsed since) noexcept
    -> Motion<N> {
  const Learns learns = since.settled ? Learns::kAll : since.rested ? Learns::kWhere : Learns::kNothing;
  const Motion<N>& slave = mediator.step(local, received, learns, since.calm);
  ahead = slave.x - received.x;
  needs = mediator.device_needs();
  return slave;
}

// Compiled once, in scenes.cpp, so that an edit of a block rebuilds little.
extern template struct FourChannel<DirectDrive<1>>;
extern template struct FourChannelCdob<DirectDrive<1>>;
extern template struct FourChannelCdob<ReferenceDrive<1>>;
extern template struct FourChannelCdobSdcv<DirectDrive<1>>;
extern template struct FourChannelCdobSdcv<ReferenceDrive<1>>;
extern template struct FourChannelMediated<DirectDrive<1>>;
extern template struct FourChannelMediated<ReferenceDrive<1>>;

}  // namespace farhand
