// Both sides of a session on one time axis: the torque at each person, and the differences between the sides. Metrics
// and report use the same curves, so that a number and its picture cannot disagree.
#pragma once

#include <cstddef>
#include <vector>

#include "common/record/session.hpp"
#include "proto/scene.pb.h"

namespace farhand {

// Two ticks further apart than this are a hole in the recording: nothing is interpolated or drawn across it.
inline constexpr double kGap_s = 0.05;

// The motion and torque of one side at its person: true values if the world is simulated, else the station's estimates.
struct SideCurves {
  std::vector<double> t_s;
  std::vector<double> x_rad, v_rad_s;
  // F, with signs such that F_m = F_s in ideal teleoperation: on the master the torque of the therapist on the device
  // (-f of the shared sign convention), on the slave the torque of the device on the hand (+f).
  std::vector<double> F_nm;
  std::vector<double> f_nm;             // as estimated, sign convention of Motion::f
  std::vector<double> playout_delay_s;  // T_p, from the peer's tick to its use here; NaN if unknown
  std::vector<int> state;               // StationState
  std::vector<double> dt_s;             // until the next tick, at most kGap_s; 0 at the last
};

struct AlignedSession {
  bool true_angle = false;                     // x and v are those of the simulated world, on both sides
  bool true_torque = false;                    // the same for F
  bool link_known = false;                     // T_p rests on measured one-way delays, not on half the round trip
  double position_scale = 1, force_scale = 1;  // of the scene, if the sides differ in size
  SideCurves master, slave;
  // Each error is NaN while a side is not engaged or its value is unknown.
  std::vector<double> tracking_rad;              // at the slave's ticks: x_s(t) - position_scale x_m(t - T_p)
  std::vector<double> force_error_nm;            // at the master's ticks: F_m(t) - force_scale F_s(t)
  std::vector<double> force_error_delayed_nm;    // at the master's ticks: f_m(t) + force_scale f_s(t - T_p), as felt
  std::vector<double> force_error_of_motion_nm;  // at the slave's ticks: force_scale F_s(t) - F_m(t - T_p)
  std::vector<double> energy_master_j;  // at the master's ticks: taken from the therapist so far, integral of F_m dx_m
  std::vector<double> energy_slave_j;   // at the slave's ticks: taken from the hand so far, integral of -F_s dx_s
};

// Ticks whose time is not finite, or not after the one before, are left out.
AlignedSession align(const Session& session, const scene::Scene& scene);

// Finds times on one time axis repeatedly, mostly a little later than the last one: a step or two from the last place
// suffice, without a search. The result does not depend on the last place.
class Walk {
 public:
  explicit Walk(const std::vector<double>& t_s) : t_s_(t_s) {}

  // The first tick that is not before t; the number of ticks if all are.
  std::size_t not_before(double t);
  // The first tick after t.
  std::size_t after(double t);
  // Linear between ticks; NaN outside the recording, within a hole, and next to a NaN.
  double interpolate(const std::vector<double>& y, double t);

 private:
  const std::vector<double>& t_s_;
  std::size_t at_ = 0;
};

}  // namespace farhand
