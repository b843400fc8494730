// A whole session as `simulate` runs it, with additions for the lab: encoders that fail, a link that tampers, a clock
// that is set, and the energy of both worlds.
#pragma once

#include <array>
#include <functional>
#include <span>
#include <vector>

#include "common/config/load.hpp"
#include "common/link/codec.hpp"
#include "common/link/receiver.hpp"
#include "common/station/engagement.hpp"
#include "netem/lab/extreme_probe.hpp"
#include "netem/link_params.hpp"

namespace farhand::extreme {

using Sets = std::vector<std::string>;

struct Letter {
  Nanoseconds due;
  std::array<std::byte, PacketCodec<1>::kSize> bytes;
};

struct SessionPlan {
  Sets sets;  // over the base scene: four channels, direct drive, ideal encoders, hand of 2 N m/rad, no delay
  double master_start = 0, slave_start = 0;  // rad
  // Reading at time t; what the station gets instead.
  std::function<double(double t_s, double reading)> master_encoder, slave_encoder;
  // What the slave's clock shows at true time t; empty: as the scene says.
  std::function<Nanoseconds(Nanoseconds)> slave_clock;
  Nanoseconds epoch = 0;  // what both clocks show at the start
  // One letter in; what it becomes.
  std::function<std::vector<Letter>(const Letter&)> to_slave, to_master;
  double steady_s = 0.5;        // the end of the run is judged over this time
  double meter_s = 250e-6;      // pieces of the energy balance
  double energy_within = 1e-6;  // relative
  std::uint64_t budget = 2'000'000;
};

struct SideRecord {
  StationState state = StationState::kOff;
  Reason reason = Reason::kStart;
  bool ever_engaged = false, ever_fault = false;
  double x_low = 1e300, x_high = -1e300;  // true angle over the last steady_s
  double f_mean = 0;                      // true torque, mean over the last steady_s
  double x_most = 0;                      // largest |angle| of the run
  double f_estimate_most = 0;             // largest |reaction torque| as estimated
  double command_most = 0;
  std::uint32_t limits = 0;  // that acted at any time
  std::array<std::uint64_t, kDecodeResults> decoded{};
  ReceiverCounters received;
  double energy = 0;
  std::string state_text() const;  // "master holding: peer silent"
  const char* who = "";
};

struct SessionRecord {
  SideRecord master, slave;
  scene::Scene scene;
  std::vector<std::string> warnings;  // at load
  Block first_bad = Block::kNone;
  bool bad_at_actuator = false;
  std::uint64_t ticks = 0, sent = 0;
  // Largest distance of a side from an angle over the last steady_s.
  double off(double master_x, double slave_x) const;
};

// Throws ConfigError or std::invalid_argument if the scene is refused.
SessionRecord run_session(const SessionPlan& plan);

// Judges a session: engaged at its end with the angles of statics, or refused with the states of both sides. master_x,
// slave_x: angles by the closed form.
Outcome judge_session(const SessionRecord& record, double master_x, double slave_x, std::string second_way);

// Where arm and hand, or wall, balance. Plain four channels: x = (K_h A + k at)/(K_h + k) on both sides. CDOB with the
// thesis's model: F_m = F_s/2 and x_m = x_s (1 + K_f k/(2 K_p)).
struct Balance {
  double master, slave;
};
Balance balance_of(const scene::Scene& scene);
Outcome judge_session(const SessionRecord& record);
// No setting may make a side leave the stops. For a side that swings there must be a warning at load, or a limit that
// acts.
Outcome judge_bounded(const SessionRecord& record);

}  // namespace farhand::extreme
