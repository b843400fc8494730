// The drives of the two kinds of axis. A drive turns readings into the local motion, and the motion to follow into a
// command. The code of the direct drive is in drive_law.hpp and is compiled once, in drive.cpp.
#pragma once

#include <utility>

#include "common/observer/rtob.hpp"
#include "common/observer/stuck_reading.hpp"
#include "common/signal/axis_speed.hpp"
#include "common/station/drive_io.hpp"
#include "common/station/limits.hpp"
#include "common/station/params.hpp"
#include "common/station/person_bound.hpp"

namespace farhand {

// How a motion is to be followed.
struct Wanted {
  bool driven = true;      // else gravity is compensated and nothing else
  bool as_torque = false;  // it is wanted for its torque: Wish
};

// Longest gap, in ticks, that the observers bridge; after a longer gap they start from the reading, at rest.
inline constexpr int kLongestGap = 100;

// A motor that takes a torque: observers and law run here (Daud 2011, B.1-B.10, 5.8-5.13).
template <int N>
class DirectDrive {
 public:
  static constexpr int kJoints = N;
  static constexpr bool kGivesTorque = true;
  using Sensed = typename DirectIo<N>::Sensed;
  using Command = typename DirectIo<N>::Command;

  explicit DirectDrive(const DriveParams& p)
      : model_(p.model),
        power_stage_(p.power_stage),
        dt_s_(p.dt_s),
        K_(p.K),
        speed_(p.g_v, p.dt_s),
        dob_(p.model.J_n, p.g_dis, p.dt_s),
        rtob_(p.model, p.g_reac, p.dt_s),
        stuck_(p.resolution, p.stiffest_nm_per_rad / p.model.J_n, speed_.guard_cutoff(), p.g_dis, p.dt_s),
        moving_{speed_, dob_, rtob_, Joints<N>::Zero()},
        bound_(p.person, p.gate, p.model.J_n, p.g_dis, p.K.K_f, p.dt_s),
        gate_(p.gate, p.dt_s),
        rise_(p.dt_s / p.take_over_s),
        fall_(p.dt_s / kLetGo) {}

  // Starts the observers at the reading, at rest, with no torque acting but the known load.
  void reset(const Sensed& sensed) noexcept;

  // ticks: periods since the last call. More than one means that ticks were missed, and that the drive meanwhile gave
  // the torque of its contract (TorqueHold).
  Motion<N> observe(const Sensed& sensed, int ticks) noexcept;

  // local, the motion of the last observe(), with the velocity by which guards judge (common/signal/axis_speed.hpp).
  Motion<N> for_guards(const Motion<N>& local) const noexcept {
    return unseen_ > 0 ? local : Motion<N>{local.x, speed_.for_guards(), local.f};
  }

  // After observe() of the same tick.
  Command follow(const Motion<N>& local, const Motion<N>& target, Wanted wanted, int ticks) noexcept;

  // Zero torque, at once: the command in a fault.
  Command safe() noexcept;

  bool at_rest(const Sensed& /*sensed*/) const noexcept { return (gate_.applied() == 0.0).all(); }
  void limit(const GateParams& gate) noexcept {  // from now on
    bound_.limit(gate);
    gate_.limit(gate);
  }

  const Joints<N>& torque() const noexcept { return gate_.applied(); }  // applied
  // Mean torque on the axis since the last tick, without the compensation of its weight.
  Joints<N> acting(const Motion<N>& /*local*/) const noexcept { return acted_ - rtob_.gravity_load(); }
  double acted_share() const noexcept { return acted_share_; }  // mean share of the last command that the drive gave
  std::uint32_t active_limits() const noexcept { return gate_.active() | limits_; }
  // Limits that act to protect the person in the device (common/station/person_bound.hpp).
  std::uint32_t spared() const noexcept { return limits_; }

 private:
  // The local motion from a reading that follows `unseen` readings that were taken for stuck, or missed ticks.
  Motion<N> across(const Joints<N>& x, int unseen, int ticks) noexcept;
  Motion<N> estimate(const Joints<N>& x, const Joints<N>& tau) noexcept;
  // Bounds the torque to ask for while the reading stands.
  Joints<N> doubted(Joints<N> wish) const noexcept;

  AxisModel model_;
  TorqueHold power_stage_;
  double dt_s_;
  FourChannelGains K_;
  AxisSpeed<N> speed_;
  Dob<N> dob_;
  Rtob<N> rtob_;
  StuckReading<N> stuck_;
  struct Observers {
    AxisSpeed<N> speed;
    Dob<N> dob;
    Rtob<N> rtob;
    Joints<N> torque;
  };
  Observers moving_;  // as they were when the reading came to stand
  int unseen_ = 0;    // ticks for which the reading was stuck
  PersonBound<N> bound_;
  TorqueGate<N> gate_;
  std::uint32_t limits_ = 0;             // limits of the person bound that act
  static constexpr double kLetGo = 0.2;  // s
  double rise_, fall_;
  double authority_ = 0.0;
  Joints<N> acted_ = Joints<N>::Zero();
  double acted_share_ = 1.0;
};

// An axis behind its own controller (the orthosis MCU). The controller measures the reaction, closes position and force
// loops at its own rate and takes the motion to follow as references. Loops closed across the serial line would have 40
// mrad of error or be unstable.
template <int N>
class ReferenceDrive {
 public:
  static constexpr int kJoints = N;
  static constexpr bool kGivesTorque = false;
  using Sensed = typename ReferenceIo<N>::Sensed;
  using Command = typename ReferenceIo<N>::Command;

  explicit ReferenceDrive(const DriveParams& p)
      : speed_(p.g_v, p.dt_s), gate_(p.gate, p.dt_s), spring_(p.K.K_f > 0.0 ? p.K.K_p / p.K.K_f : 0.0) {}

  void reset(const Sensed& sensed) noexcept {
    speed_.reset(sensed.x);
    gate_.reset(sensed.x);
    bounded_ = false;
  }

  Motion<N> observe(const Sensed& sensed, int ticks) noexcept {
    bounded_ = sensed.device.bounded;
    if (ticks > kLongestGap) speed_.reset(sensed.x);
    return {sensed.x, ticks > 1 ? speed_.across(sensed.x, ticks) : speed_.step(sensed.x), sensed.f};
  }
  Motion<N> for_guards(const Motion<N>& local) const noexcept { return {local.x, speed_.for_guards(), local.f}; }

  // In torque mode the distance to the target, which fades in, counts with the spring by which the device would follow.
  Command follow(const Motion<N>& local, const Motion<N>& target, Wanted wanted, int ticks) noexcept {
    if (!wanted.driven) {
      gate_.reset(local.x);
      return {.reference = gate_.applied()};
    }
    if (!wanted.as_torque) return {.track = true, .reference = gate_.pass(target, ticks)};
    const Motion<N> wish = {target.x, target.v, target.f - spring_ * (target.x - local.x)};
    return {.track = true, .gives_torque = true, .reference = gate_.pass(wish, ticks)};
  }

  Command safe() noexcept {
    bounded_ = false;
    return {.stop = true, .reference = gate_.applied()};
  }

  bool at_rest(const Sensed& sensed) const noexcept { return sensed.at_rest; }
  void limit(const GateParams& gate) noexcept { gate_.limit(gate); }  // from now on

  const Joints<N>& torque() const noexcept { return gate_.applied().f; }  // asked of the device
  Joints<N> acting(const Motion<N>& local) const noexcept {
    return local.f;
  }                                                    // torque of its spring, reduced to the hand
  double acted_share() const noexcept { return 1.0; }  // the MCU holds the torque that was asked for
  std::uint32_t active_limits() const noexcept { return gate_.active(); }
  // The limit by which the device protects the person in it.
  std::uint32_t spared() const noexcept { return bounded_ ? kLimitDevice : 0u; }

 private:
  AxisSpeed<N> speed_;
  ReferenceGate<N> gate_;
  double spring_;  // N m/rad
  bool bounded_ = false;
};

template <class Io>
struct DriveOf;
template <int N>
struct DriveOf<DirectIo<N>> {
  using Drive = DirectDrive<N>;
};
template <int N>
struct DriveOf<ReferenceIo<N>> {
  using Drive = ReferenceDrive<N>;
};
template <class Io>
using DriveOn = typename DriveOf<Io>::Drive;

extern template class DirectDrive<1>;

}  // namespace farhand
