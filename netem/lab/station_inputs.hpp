// The inputs of a scene's stations in a run, so that one station can be run alone.
#pragma once

#include <algorithm>
#include <vector>

#include "common/link/packet.hpp"
#include "common/record/session.hpp"

namespace farhand {

struct Arrival {
  Nanoseconds at;
  Packet<1> packet;
};

// The packets of the peer in the order in which they came.
inline std::vector<Arrival> arrivals_of(const Session& session, bool to_master) {
  std::vector<Arrival> arrivals;
  const std::vector<StationSample>& from = to_master ? session.slave : session.master;
  std::size_t k = 0;
  for (const LinkSample& sent : session.link) {
    if (sent.forward == to_master) continue;
    const StationSample& row = from[k++];
    if (sent.lost) continue;
    Packet<1> packet;
    packet.session = 7;
    packet.seq = static_cast<std::uint32_t>(k);
    packet.send_time_ns = from_seconds(sent.t_s);
    packet.state = static_cast<StationState>(row.state);
    packet.motion = {Joints<1>(row.x_rad), Joints<1>(row.v_rad_s), Joints<1>(row.f_nm)};
    arrivals.push_back({from_seconds(sent.t_s + sent.achieved_delay_s), packet});
  }
  std::stable_sort(arrivals.begin(), arrivals.end(), [](const Arrival& a, const Arrival& b) { return a.at < b.at; });
  return arrivals;
}

// Runs a station on all these inputs. tick(now, row): the station's own tick.
template <class Station, class Tick>
void through(Station& station, const std::vector<StationSample>& rows, const std::vector<Arrival>& arrivals,
             Tick&& tick) {
  auto next = arrivals.begin();
  for (const StationSample& row : rows) {
    const Nanoseconds now = from_seconds(row.t_s);
    for (; next != arrivals.end() && next->at <= now; ++next) station.receive(next->packet, next->at);
    tick(now, row);
  }
}

}  // namespace farhand
