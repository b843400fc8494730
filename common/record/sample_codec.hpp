// Between the plain structs that a loop fills and the messages of record.proto that a file holds. What a side cannot
// know (NaN in true_*) is absent in the file.
#pragma once

#include "common/record/session.hpp"
#include "common/signal/joints.hpp"
#include "proto/record.pb.h"

namespace farhand {

// The true world of the emulated orthosis.
struct McuSample {
  double true_x_rad = 0, true_v_rad_s = 0,
         true_f_nm = 0;    // f_nm: between orthosis and hand, sign convention of Motion::f
  double motor_x_rad = 0;  // seen at the joint
  double spring_torque_nm = 0;
  double torque_command_nm = 0;
  int state = 0;
};

// Times of samples travel beside them, in nanoseconds: t_s of the structs is not used here.
void encode(Nanoseconds t, const StationSample& sample, record::StationSample& message);
void encode(Nanoseconds t, const LinkSample& sample, record::LinkSample& message);
void encode(Nanoseconds t, const McuSample& sample, record::McuSample& message);
void encode(const StationCounters& counters, record::Counters& message);

StationSample decode(const record::StationSample& message);
LinkSample decode(const record::LinkSample& message);
McuSample decode(const record::McuSample& message);
StationCounters decode(const record::Counters& message);

}  // namespace farhand
