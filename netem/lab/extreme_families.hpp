// The families of the catalogue, one function per file.
#pragma once

#include "netem/lab/extreme_session.hpp"

namespace farhand::extreme {

using Cases = std::vector<Case>;

// One unit of an angle in a frame to the MCU, rad: no session with an orthosis is closer to statics than that.
constexpr double kFrame = 1.0 / 8192;
// The stops of the slave's side, and how far its largest torque can throw it into one: 3 N m over the whole range are
// 3.14 J, and a stop of 3000 N m/rad takes them in 46 mrad.
constexpr double kStops = 0.5236 + 0.046;

void add_contact(Cases& cases);     // walls, short and double contacts, no damping, no mass
void add_stiff(Cases& cases);       // bristles, springs, ratios of inertia, light plants
void add_methods(Cases& cases);     // every integrator on every stiff plant
void add_control(Cases& cases);     // control periods, cut-offs, gains, J_n, encoders
void add_saturation(Cases& cases);  // torque, speed and encoder saturation
void add_network(Cases& cases);     // delays, jitter, loss, tampered packets, clocks
void add_faults(Cases& cases);      // 24 h, starts at the stops, denormals
void add_sensors(Cases& cases);     // NaN and Inf from each sensor

// A session over the base scene, judged by statics.
Case session_case(std::string family, std::string name, Expected expected, Sets sets);
Case session_case(std::string family, std::string name, Expected expected, SessionPlan plan);

// A session that may not settle, but may not leave the stops either.
Case bounded_case(std::string family, std::string name, double by, std::string why, Sets sets);

// The same settings for both directions of the link.
Sets both_ways(const std::vector<std::string>& settings);

}  // namespace farhand::extreme
