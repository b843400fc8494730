// A session in which a side identifies its axis.
#pragma once

#include <string>
#include <vector>

#include "common/config/load.hpp"
#include "netem/lab/simulation.hpp"

namespace farhand {

// zero_delay without hands: both axes are free.
inline std::vector<std::string> freed(std::vector<std::string> more, double duration_s = 58) {
  std::vector<std::string> sets = {"windows={}",
                                   "duration_s=" + std::to_string(duration_s),
                                   "slave.axis.identification={}",
                                   "master.axis.identification={}",
                                   "slave.hand={from_s: 1e6}",
                                   "master.therapist={grip: CUSTOM K_h_nm_per_rad: 0 B_h_nms_per_rad: 0 J_h_kgm2: 0}",
                                   "slave.motor.coulomb_nm=0.02",
                                   "slave.axis.coulomb_nm=0.02",
                                   "operator_acts[0]={at_s: 0.5 act: IDENTIFY by: PATIENT}"};
  sets.insert(sets.end(), more.begin(), more.end());
  return sets;
}

inline Session session_of(const std::vector<std::string>& sets) { return simulate(load_scene("zero_delay", sets)); }

}  // namespace farhand
