// The settings of a station and of what is in it, apart from the code that they set.
#pragma once

#include <string_view>

#include "common/law/params.hpp"
#include "common/link/receiver_params.hpp"
#include "common/observer/axis_model.hpp"
#include "common/observer/oscillation.hpp"
#include "common/observer/plausibility.hpp"
#include "common/signal/motion.hpp"
#include "common/signal/torque_hold.hpp"
#include "common/station/engagement.hpp"
#include "common/station/homing.hpp"
#include "common/station/identifying_params.hpp"
#include "common/station/patient_limits.hpp"

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
  double stiffest_nm_per_rad = 30;  // that the axis may meet
  TorqueHold power_stage{.hold_s = 2e-3, .fall_s = 4e-3};
  bool power_stage_named = false;  // by the scene
  double take_over_s = 0.5;        // the law's share of the torque rises from 0 to 1 in this time
  double dt_s = 1e-3;
};

// What moves an axis: its drive, and the law above it.
struct ControlParams {
  DriveParams drive;
  LawParams law;
};

// What the patient's side allows, whatever the network asks (common/station/patient_guard.hpp).
struct GuardParams {
  PatientLimits limits;
  PlausibilityParams plausibility;
  OscillationParams oscillation;
};

// Where the sides differ in size, what crosses the network is the slave's, and the master's station converts.
struct Scale {
  double position = 1.0;  // angle of the slave per angle of the master
  double force = 1.0;     // torque at the master per torque at the slave
  bool any() const noexcept { return position != 1.0 || force != 1.0; }

  // A motion of the peer in the leader's size, and one of the leader in that of the peer.
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
  HomingParams homing;            // used where the engagement asks for it
  IdentifyingParams identifying;  // so too
  GuardParams guard;              // limits: the follower's only
  double align_speed = 0.3;       // rad/s
  double align_tolerance = 0.01;  // rad
  double blend_s = 0.5;
  std::uint32_t session = 1;
  std::uint32_t expiry_ms = 2000;
};

}  // namespace farhand
