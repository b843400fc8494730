// The settings of a station and its blocks, apart from their code.
#pragma once

#include <string_view>

#include "common/law/params.hpp"
#include "common/link/receiver_params.hpp"
#include "common/observer/axis_model.hpp"
#include "common/observer/oscillation.hpp"
#include "common/observer/plausibility.hpp"
#include "common/signal/known_friction.hpp"
#include "common/signal/motion.hpp"
#include "common/signal/torque_hold.hpp"
#include "common/station/engagement.hpp"
#include "common/station/homing.hpp"
#include "common/station/identifying_params.hpp"
#include "common/station/patient_limits.hpp"
#include "common/station/sweeping.hpp"

namespace farhand {

struct DriveParams {
  AxisModel model;
  FourChannelGains K;
  Cutoff g_dis = Cutoff::rad_s(200.0);
  Cutoff g_reac = Cutoff::rad_s(200.0);
  Cutoff g_v = Cutoff::rad_s(500.0);
  GateParams gate;
  PersonBoundParams person;
  double resolution = 3.2e-4;       // rad: one count of the encoder
  double stiffest_nm_per_rad = 30;  // stiffest object that the axis may meet
  TorqueHold power_stage{.hold_s = 2e-3, .fall_s = 4e-3};
  bool power_stage_named = false;  // by the scene
  double take_over_s = 0.5;        // the law's share of the torque rises from 0 to 1 in this time
  double dt_s = 1e-3;
};

// The settings of a drive and of the law above it.
struct ControlParams {
  DriveParams drive;
  LawParams law;
};

// Limits of the patient's side, whatever the network asks for (common/station/patient_guard.hpp).
struct GuardParams {
  PatientLimits limits;
  PlausibilityParams plausibility;
  OscillationParams oscillation;
};

// If the devices differ in size, the signals on the network have the slave's size, and the master's station converts.
struct Scale {
  double position = 1.0;  // angle of the slave per angle of the master
  double force = 1.0;     // torque at the master per torque at the slave
  bool any() const noexcept { return position != 1.0 || force != 1.0; }

  // Converts a motion of the peer to the leader's size, and a motion of the leader to the peer's.
  template <int N>
  Motion<N> to_own(const Motion<N>& peer) const noexcept {
    return any() ? Motion<N>{peer.x / position, peer.v / position, peer.f * force} : peer;
  }
  template <int N>
  Motion<N> to_peer(const Motion<N>& own) const noexcept {
    return any() ? Motion<N>{own.x * position, own.v * position, own.f / force} : own;
  }
};

struct StationParams {
  Role role = Role::kLeader;
  Scale scale;                                     // the leader's only
  std::string_view architecture = "FOUR_CHANNEL";  // common/law/architectures.hpp
  ControlParams control;
  ReceiverParams receive;
  IntakeParams intake;
  EngagementParams engagement;
  HomingParams homing;            // used only if the engagement asks for it
  IdentifyingParams identifying;  // used only if the engagement asks for it
  GuardParams guard;              // limits: the follower's only
  KnownFriction friction;         // the follower's only
  SweepingParams sweeping;        // the follower's only
  double align_speed = 0.3;       // rad/s
  double align_tolerance = 0.01;  // rad
  double blend_s = 0.5;
  std::uint32_t session = 1;
  std::uint32_t expiry_ms = 2000;
};

}  // namespace farhand
