// The families of the catalogue, one function per file.
#pragma once

#include "tests/lab/extreme_session.hpp"

namespace farhand::extreme {

using Cases = std::vector<Case>;

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
