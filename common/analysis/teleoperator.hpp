// Both sides joined by the network: does a motion that goes around through both delays die out? The model is linear and
// complete: laws, observers and CDOB as the stations run them, the therapist's arm, the object that the slave touches,
// the delay in whole ticks. Growing motions are counted by the argument principle, because the delay line has hundreds
// of states.
#pragma once

#include <functional>

#include "common/analysis/orthosis_loop.hpp"
#include "common/analysis/side_loop.hpp"

namespace farhand {

struct Teleoperator {
  SideLoop master;  // its axis includes the therapist's arm
  // Response of the slave: the motion that it sends, to an acceleration.
  std::function<SideResponse::Sent(std::complex<double> z)> slave;
  int round_trip = 2;        // ticks from a master's tick to the tick in which its effect is received
  bool compensated = false;  // CDOB
  bool with_force = false;   // its model includes f_s
  double alpha = 1.0;        // of the SDCV, taken as constant
  double g_net = 1000.0;
};

std::function<SideResponse::Sent(std::complex<double> z)> direct_slave(const SideLoop& loop);
// tick_s, g_v: of the station that reads the orthosis over the serial line.
std::function<SideResponse::Sent(std::complex<double> z)> orthosis_slave(const OrthosisLoop& loop, double tick_s,
                                                                         double g_v);

// Number of motions that grow by more than this factor per tick; each side by itself must be stable.
int growing_motions(const Teleoperator& teleoperator, double factor = 1.0);

// Two channels (common/law/two_channel.hpp), whose law moves an axis by K_f times a torque: the loops of both sides
// are those of the force alone, without K_p and K_d.
//
//   u_m = -K_f F,  u_s = K_f (F z^-R_1 - B_slave v_s),  F = K_2 (x_m - x_s z^-R_2) + B_2 (v_m - v_s z^-R_2)
struct TwoChannels {
  SideLoop master;
  std::function<SideResponse::Sent(std::complex<double> z)> slave;
  double K_f_slave = 250.0;
  int round_trip = 2;
  double K_2 = 5.0, B_2 = 0.05, B_slave = 0.1;
};

int growing_motions(const TwoChannels& loop, double factor = 1.0);

}  // namespace farhand
