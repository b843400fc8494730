// Both sides joined by the network: does what goes around through both delays die out? Linear, and complete: laws,
// observers and CDOB as the stations run them, the therapist's arm, what the slave touches, the delay in whole ticks.
// The number of growing motions is counted by the argument principle, because the delay line has hundreds of states.
#pragma once

#include <functional>

#include "common/analysis/orthosis_loop.hpp"
#include "common/analysis/side_loop.hpp"

namespace farhand {

struct Teleoperator {
  SideLoop master;  // its axis includes the therapist's arm
  // How the slave answers an acceleration with what it sends.
  std::function<SideResponse::Sent(std::complex<double> z)> slave;
  int round_trip = 2;        // ticks from the master's tick to the one in which it hears of it
  bool compensated = false;  // CDOB
  bool with_force = false;   // its model knows f_s
  double alpha = 1.0;        // of the SDCV, as if it stood still
  double g_net = 1000.0;
};

std::function<SideResponse::Sent(std::complex<double> z)> direct_slave(const SideLoop& loop);
// tick_s, g_v: of the station that reads the orthosis over the serial line.
std::function<SideResponse::Sent(std::complex<double> z)> orthosis_slave(const OrthosisLoop& loop, double tick_s,
                                                                         double g_v);

// Motions of the whole that grow by more than this factor per tick; each side by itself must not.
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
