// Scenes whose law gives a torque and not a motion: two channels, wave variables. A torque is told as the motion that
// asks for it: where the axis is already, and the reaction -tau. A drive that closes the loop here follows it,
//
//   a_ref = C_p (x - x) - K_f (-tau + f) = K_f (tau - f)
//
// by which the axis is an inertia of 1/K_f under tau, its own friction compensated. A device behind its own controller
// is asked for the torque: the same law without C_p, whose x and v would come to it late, and within an energy
// (slave/mcu/orthosis_mcu.hpp).
//
// What these scenes send besides the angle, by which the sides align, stands where four channels send f: the torque of
// the master, or the integral of a wave in sqrt(W) s. (Every packet has one layout.)
#pragma once

#include "common/control/two_channel.hpp"
#include "common/control/wave.hpp"
#include "common/scene/drive.hpp"
#include "common/scene/tick_trace.hpp"

namespace farhand {

template <class D>
Motion<D::kJoints> asks_for(D& drive, const Joints<D::kJoints>& tau, const Motion<D::kJoints>& local) noexcept {
  if constexpr (!D::kGivesTorque) drive.ask_for_torque();
  return {local.x, local.v, -tau};
}

template <class D>
struct TwoChannelMaster {
  using Drive = D;
  static constexpr int N = D::kJoints;
  explicit TwoChannelMaster(const SceneParams& p) : drive(p.drive), params(p.two_channel) {}

  Drive drive;
  TwoChannelParams params;
  HeldTo<N> F;
  double acting = 1.0;  // of it, what is given on an average

  void start(const Motion<N>& /*local*/, const Motion<N>& /*received*/) noexcept { F.reset(); }
  Motion<N> target(const Motion<N>& local, const Motion<N>& received, Elapsed since) noexcept;
  Motion<N> outgoing(const Motion<N>& local) const noexcept { return {local.x, local.v, -acting * F.value()}; }
  Compensation compensation() const noexcept { return {}; }
};

template <class D>
struct TwoChannelSlave {
  using Drive = D;
  static constexpr int N = D::kJoints;
  explicit TwoChannelSlave(const SceneParams& p) : drive(p.drive), params(p.two_channel) {}

  Drive drive;
  TwoChannelParams params;

  void start(const Motion<N>& /*local*/, const Motion<N>& /*received*/) noexcept {}
  Motion<N> target(const Motion<N>& local, const Motion<N>& received, Elapsed since) noexcept;
  Compensation compensation() const noexcept { return {}; }
};

template <class D>
struct WaveMaster {
  using Drive = D;
  static constexpr int N = D::kJoints;
  explicit WaveMaster(const SceneParams& p)
      : drive(p.drive), wave(p.wave), received_wave(p.drive.dt_s), dt_s(p.drive.dt_s) {}

  Drive drive;
  MasterWave<N> wave;
  ReceivedWave<N> received_wave;
  double dt_s;
  Joints<N> U = Joints<N>::Zero();  // integral of u_m, sqrt(W) s

  void start(const Motion<N>& /*local*/, const Motion<N>& received) noexcept { received_wave.reset(received.f); }
  Motion<N> target(const Motion<N>& local, const Motion<N>& received, Elapsed since) noexcept;
  Motion<N> outgoing(const Motion<N>& local) const noexcept { return {local.x, local.v, U}; }
  Compensation compensation() const noexcept { return {}; }
};

template <class D>
struct WaveSlave {
  using Drive = D;
  static constexpr int N = D::kJoints;
  explicit WaveSlave(const SceneParams& p)
      : drive(p.drive), wave(p.wave, p.drive.dt_s), received_wave(p.drive.dt_s), dt_s(p.drive.dt_s) {}

  Drive drive;
  SlaveWave<N> wave;
  ReceivedWave<N> received_wave;
  double dt_s;
  Joints<N> U = Joints<N>::Zero();  // integral of u_s

  void start(const Motion<N>& local, const Motion<N>& received) noexcept;
  Motion<N> target(const Motion<N>& local, const Motion<N>& received, Elapsed since) noexcept;
  Motion<N> outgoing(const Motion<N>& local) const noexcept { return {local.x, local.v, U}; }
  Compensation compensation() const noexcept { return {}; }
};

template <class D>
auto TwoChannelMaster<D>::target(const Motion<N>& local, const Motion<N>& received, Elapsed since) noexcept
    -> Motion<N> {
  acting = since.acting;
  return asks_for<D>(drive, -since.peers_acting * F.step(params, local, received, since.silent_s), local);
}

template <class D>
auto TwoChannelSlave<D>::target(const Motion<N>& local, const Motion<N>& received, Elapsed since) noexcept
    -> Motion<N> {
  return asks_for<D>(drive, -since.acting * received.f - params.B_slave * local.v, local);
}

template <class D>
auto WaveMaster<D>::target(const Motion<N>& local, const Motion<N>& received, Elapsed since) noexcept -> Motion<N> {
  wave.step(local.v, received_wave.step(received.f, since.ticks, since.held));
  U += dt_s * since.ticks * wave.sent();
  return asks_for(drive, -wave.force(), local);
}

template <class D>
void WaveSlave<D>::start(const Motion<N>& local, const Motion<N>& received) noexcept {
  received_wave.reset(received.f);
  wave.reset(local.x);
}

template <class D>
auto WaveSlave<D>::target(const Motion<N>& local, const Motion<N>& received, Elapsed since) noexcept -> Motion<N> {
  wave.step(local, received_wave.step(received.f, since.ticks, since.held), received.x, since.ticks);
  U += dt_s * since.ticks * wave.sent();
  return asks_for(drive, wave.force(), local);
}

// Compiled once, in torque_scenes.cpp.
extern template struct TwoChannelMaster<DirectDrive<1>>;
extern template struct TwoChannelMaster<ReferenceDrive<1>>;
extern template struct TwoChannelSlave<DirectDrive<1>>;
extern template struct TwoChannelSlave<ReferenceDrive<1>>;
extern template struct WaveMaster<DirectDrive<1>>;
extern template struct WaveMaster<ReferenceDrive<1>>;
extern template struct WaveSlave<DirectDrive<1>>;
extern template struct WaveSlave<ReferenceDrive<1>>;

}  // namespace farhand
