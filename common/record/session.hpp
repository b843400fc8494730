// A run in memory: the samples of both sides, tick by tick, and those of the network. The lab fills it directly,
// `farhand-lab report` fills it from recordings; metrics and report read nothing else.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "common/law/law.hpp"

namespace farhand {

inline constexpr double kAbsent = std::numeric_limits<double>::quiet_NaN();  // an absent number

// One tick of one station. Times are in seconds on the axis of the session (0 = start of the run). NaN marks values
// that a side cannot know: true_* exist only if the world is simulated.
struct StationSample {
  double t_s = 0;
  int state = 0;                                                 // StationState
  double x_rad = 0, v_rad_s = 0, f_nm = 0;                       // own axis, as estimated
  double remote_x_rad = 0, remote_v_rad_s = 0, remote_f_nm = 0;  // the peer, as played out
  double target_x_rad = 0;                                       // position that the law follows
  double command_nm = 0;                        // torque applied after all limits, or torque reference sent to the MCU
  double x_cdob_rad = 0;                        // added to the received angle by CDOB or mediator; 0 without one
  double alpha = 1;                             // share of it that is used; 1 without one
  LawSignals::Own law = LawSignals::nothing();  // the law's own signals, under Session::master_signals, slave_signals
  double playout_delay_s = 0;                   // play-out beyond the fastest packet (depth of the buffer)
  double rtt_s = 0;                             // newest round trip measured by echo
  std::uint32_t limits = 0;                     // LimitBit
  double true_x_rad = 0;                        // true angle in the simulated world
  double true_v_rad_s = 0;
  double true_f_nm = 0;  // true torque between device and person, sign convention of Motion::f
  // Send stamp of the newest accepted packet on the peer's clock, and its arrival on the own clock. Integers, because
  // the offset of the clocks is the difference of two large numbers. 0 before the first packet.
  std::int64_t newest_peer_send_ns = 0, newest_peer_arrival_ns = 0;
};

// One packet through the link.
struct LinkSample {
  double t_s = 0;       // when it was sent (entered the shim)
  bool forward = true;  // master to slave
  bool lost = false;
  double asked_delay_s = 0;
  double achieved_delay_s = 0;
};

// The true world of the emulated orthosis.
struct McuSample {
  double t_s = 0;
  double true_x_rad = 0, true_v_rad_s = 0, true_f_nm = 0;  // f_nm: between orthosis and hand, signed as Motion::f
  double motor_x_rad = 0;                                  // seen at the joint
  double spring_torque_nm = 0;
  double torque_command_nm = 0;
  int state = 0;
};

struct SessionEvent {
  double t_s = 0;
  std::string who;  // master, slave, netem, mcu
  std::string text;
};

// Totals that a side counts for itself.
struct StationCounters {
  std::uint64_t ticks = 0, overruns = 0, missed_ticks = 0, sent = 0, received = 0, late = 0, reordered = 0,
                duplicate = 0, lost = 0, rejected_checksum = 0, rejected_format = 0, rejected_session = 0,
                rejected_expired = 0, rejected_not_finite = 0, serial_crc_errors = 0, serial_sent = 0,
                serial_received = 0, record_overflow = 0,
                record_unwritten = 0;  // samples for which the ring, or the disk, had no room
  // Dropped datagrams, as in LinkDrops.
  std::uint64_t rejected_foreign = 0, dropped_too_long = 0, dropped_by_kernel = 0, dropped_handshake = 0,
                send_failed = 0;
  // Time of a command and its echo on the serial line: the least and the most; number of echoes that took 10 ms more.
  std::uint64_t serial_need_us = 0, serial_most_us = 0, serial_warned = 0, serial_sagged = 0;
  std::uint64_t cut_ticks = 0;  // ticks in which the intake cut a value of the peer, as TickTrace::cuts
};

// Friction of the patient's device, as the box took it.
struct DeviceFriction {
  double threshold_nm = kAbsent;                 // a reaction below it may come without a hand; absent: not recorded
  bool measured = false;                         // by a sweep not older than a day; else the threshold is assumed
  double F_c_nm = kAbsent, spread_nm = kAbsent;  // of the last sweep; absent: there was none
  std::int64_t swept_utc_s = 0;                  // its time, since 1970; 0: within a run in virtual time
};

// Measurements by the wall clock, of the worse side; NaN if not measured.
struct WallClock {
  double real_time_factor = std::numeric_limits<double>::quiet_NaN();
  double tick_p50_us = std::numeric_limits<double>::quiet_NaN();
  double tick_p99_us = std::numeric_limits<double>::quiet_NaN();
  double tick_max_us = std::numeric_limits<double>::quiet_NaN();
};

// Names for the signals of laws in recordings that were made before the signals had names.
inline constexpr std::array kUnnamedSignals{"energy_j", "friction_nm", "f_2_nm"};

// A signal of a law by its name; NaN if the law has no such signal.
inline double law_signal(const StationSample& row, const std::vector<std::string>& names, std::string_view name) {
  for (std::size_t i = 0; i < names.size() && i < row.law.size(); ++i) {
    if (names[i] == name) return row.law[i];
  }
  return kAbsent;
}

struct Session {
  std::string scene_name;
  std::string scene_text;  // the whole scene as text, defaults filled in
  std::uint64_t seed = 0;
  bool deterministic = false;       // virtual time: numbers of the wall clock are left out of the results
  double clock_offset_s = 0;        // added to the slave's times to get the master's
  double clock_offset_bound_s = 0;  // the true offset lies within +- this
  std::vector<std::string> master_signals, slave_signals;  // names of StationSample::law
  std::vector<StationSample> master, slave;
  std::vector<LinkSample> link;
  std::vector<SessionEvent> events;
  StationCounters master_counters, slave_counters;
  DeviceFriction friction;  // at the end
  WallClock wall;
};

}  // namespace farhand
