// Metrics of the network, and of the PCs' clocks.
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "common/judge/metric_parts.hpp"
#include "common/judge/statistics.hpp"
#include "common/judge/verdict.hpp"
#include "common/link/packet.hpp"

namespace farhand {
namespace {

constexpr int kEngaged = static_cast<int>(StationState::kEngaged);

void set_share(Metrics& out, std::string_view key, double part, double whole, const std::string& because) {
  if (whole > 0)
    out.set(key, part / whole);
  else
    out.set_absent(key, because);
}

}  // namespace

void network_metrics(const Session& session, const AlignedSession& a, Metrics& out) {
  // One-way delay of each direction, from the network's own recording; jitter is that of the worse one.
  double jitter_s = kAbsent;
  for (const bool forward : {true, false}) {
    std::vector<double> delays;
    for (const LinkSample& p : session.link) {
      if (p.forward == forward && !p.lost && std::isfinite(p.achieved_delay_s)) delays.push_back(p.achieved_delay_s);
    }
    const std::string prefix = forward ? "delay_forward" : "delay_backward";
    if (delays.empty()) {
      for (const auto* suffix : {"_median_ms", "_p99_ms"})
        out.set_absent(prefix + suffix, "no one-way delay was recorded");
      continue;
    }
    Statistics s;
    for (const double delay : delays) s.add(delay);
    // About the mean, in a second pass: sum of squares minus squared mean loses every digit at a large steady delay.
    Statistics about_mean;
    for (const double delay : delays) about_mean.add(delay - s.mean());
    jitter_s = std::fmax(jitter_s, about_mean.rms());
    out.set(prefix + "_median_ms", 1e3 * quantile(delays, 0.5));
    out.set(prefix + "_p99_ms", 1e3 * quantile(delays, 0.99));
  }
  if (std::isfinite(jitter_s))
    out.set("jitter_ms", 1e3 * jitter_s);
  else
    out.set_absent("jitter_ms", "no one-way delay was recorded");

  // Round trip and play-out as the stations measured them.
  std::vector<double> rtt, depth;
  for (const StationSample& s : session.master) {
    if (std::isfinite(s.rtt_s) && s.rtt_s > 0) rtt.push_back(s.rtt_s);
  }
  for (const StationSample& s : session.slave) {
    if (s.state == kEngaged && std::isfinite(s.playout_delay_s)) depth.push_back(s.playout_delay_s);
  }
  if (rtt.empty())
    out.set_absent("rtt_median_ms", "no round trip was measured");
  else
    out.set("rtt_median_ms", 1e3 * quantile(rtt, 0.5));
  if (depth.empty())
    out.set_absent("playout_median_ms", "the slave was never engaged");
  else
    out.set("playout_median_ms", 1e3 * quantile(depth, 0.5));

  // Packets: loss as the network recorded it, else as the receivers counted it. Receivers count late packets apart from
  // those that were used.
  const StationCounters &m = session.master_counters, &s = session.slave_counters;
  const auto late = static_cast<double>(m.late + s.late), arrived = static_cast<double>(m.received + s.received) + late;
  if (!session.link.empty()) {
    const auto lost =
        std::count_if(session.link.begin(), session.link.end(), [](const LinkSample& p) { return p.lost; });
    out.set("loss", static_cast<double>(lost) / static_cast<double>(session.link.size()));
  } else {
    const auto lost = static_cast<double>(m.lost + s.lost);
    set_share(out, "loss", lost, arrived + lost, "no packet was recorded");
  }
  set_share(out, "late", late, arrived, "no packet was received");
  set_share(out, "reordered", static_cast<double>(m.reordered + s.reordered), arrived, "no packet was received");

  // The delay on which the delayed errors rest.
  if (a.link_known)
    out.set("delay_source", "link");
  else if (!rtt.empty())
    out.set("delay_source", "half_rtt");
  else
    out.set_absent("delay_source", "neither one-way delay nor round trip was recorded");
}

void clock_metrics(const Session& session, Metrics& out) {
  if (session.deterministic) {
    for (const Metric& metric : out.all()) {
      if (!metric.info->deterministic) out.set_absent(metric.info->key, "the run was in virtual time");
    }
    if (std::isfinite(session.wall.real_time_factor)) out.set("real_time_factor", session.wall.real_time_factor);
    return;
  }
  const auto share = [](const StationCounters& c) {
    return c.ticks > 0 ? static_cast<double>(c.overruns) / static_cast<double>(c.ticks) : kAbsent;
  };
  out.set("overruns", std::fmax(share(session.master_counters), share(session.slave_counters)));
  out.set("missed_ticks", std::fmax(missed_share(session.master_counters), missed_share(session.slave_counters)));
  out.set("longest_gap_ms", 1e3 * std::fmax(longest_gap_s(session.master, session.master_counters),
                                            longest_gap_s(session.slave, session.slave_counters)));
  out.set("real_time_factor", session.wall.real_time_factor);
  out.set("tick_p50_us", session.wall.tick_p50_us);
  out.set("tick_p99_us", session.wall.tick_p99_us);
  out.set("tick_max_us", session.wall.tick_max_us);
}

}  // namespace farhand
