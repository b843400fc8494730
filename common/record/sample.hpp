// Makes a row of a recording from a station's tick.
#pragma once

#include "common/device/truth.hpp"
#include "common/link/receiver.hpp"
#include "common/record/session.hpp"
#include "common/station/tick_trace.hpp"

namespace farhand {

inline StationSample sample_of(const TickTrace<1>& trace, const Receiver<1>& receiver, const Truth& truth,
                               double t_s) noexcept {
  StationSample row;
  row.t_s = t_s;
  row.state = static_cast<int>(trace.state);
  row.x_rad = trace.local.x[0];
  row.v_rad_s = trace.local.v[0];
  row.f_nm = trace.local.f[0];
  row.remote_x_rad = trace.remote.x[0];
  row.remote_v_rad_s = trace.remote.v[0];
  row.remote_f_nm = trace.remote.f[0];
  row.target_x_rad = trace.target.x[0];
  row.command_nm = trace.effort;
  row.x_cdob_rad = trace.law.x_cdob;
  row.alpha = trace.law.alpha;
  row.law = trace.law.own;
  row.playout_delay_s = to_seconds(trace.playout_depth);
  row.rtt_s = to_seconds(trace.rtt);
  row.limits = trace.limits;
  if (receiver.heard()) {
    row.newest_peer_send_ns = receiver.newest().send_time_ns;
    row.newest_peer_arrival_ns = receiver.newest_arrival();
  }
  row.true_x_rad = truth.x;
  row.true_v_rad_s = truth.v;
  row.true_f_nm = truth.f;
  return row;
}

// The receiver's counters, over all sessions of the peer.
inline StationCounters counters_of(const ReceiverCounters& receiver) noexcept {
  StationCounters total;
  total.received = receiver.received;
  total.late = receiver.late;
  total.reordered = receiver.reordered;
  total.duplicate = receiver.duplicate;
  total.lost = receiver.lost;
  total.rejected_session = receiver.rejected_session;
  total.rejected_expired = receiver.rejected_expired;
  total.rejected_format = receiver.rejected_stamp;
  total.rejected_not_finite = receiver.rejected_not_finite;
  return total;
}

}  // namespace farhand
