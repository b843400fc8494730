#include "common/judge/metrics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "common/judge/alignment.hpp"
#include "common/judge/friction_source.hpp"
#include "common/judge/verdict.hpp"
#include "common/link/packet.hpp"

namespace farhand {
namespace {

constexpr int kEngaged = static_cast<int>(StationState::kEngaged);
constexpr int kFault = static_cast<int>(StationState::kFault);

constexpr double kTail_s = 2.0;           // steady values are taken over this much of the end of the contact window
constexpr double kResidual_rad = 0.005;   // less than this at rest is stable without further questions
constexpr double kLeastTorque_nm = 1e-3;  // below these a ratio is only noise over noise
constexpr double kLeastAngle_rad = 1e-3;
constexpr double kLeastMotion_rad_s = 1e-6;

struct Span {
  double from_s, until_s;
  bool has(double t) const { return t >= from_s && t < until_s; }
};

Span everything() { return {-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()}; }
Span tail_of(const Span& w) { return {std::max(w.from_s, w.until_s - kTail_s), w.until_s}; }
Span before_tail_of(const Span& w) {
  return {std::max(w.from_s, w.until_s - 2 * kTail_s), std::max(w.from_s, w.until_s - kTail_s)};
}

struct Statistics {
  std::size_t count = 0;
  double sum = 0, sum_squares = 0, least = kAbsent, most = kAbsent;
  void add(double y) {
    if (!std::isfinite(y)) return;
    ++count;
    sum += y;
    sum_squares += y * y;
    least = std::fmin(least, y);
    most = std::fmax(most, y);
  }
  double mean() const { return sum / static_cast<double>(count); }
  double rms() const { return std::sqrt(sum_squares / static_cast<double>(count)); }
  double peak() const { return std::max(std::abs(least), std::abs(most)); }
  double peak_to_peak() const { return most - least; }
};

Statistics over(const std::vector<double>& t_s, const std::vector<double>& y, const Span& span) {
  Statistics out;
  for (std::size_t k = 0; k < t_s.size(); ++k) {
    if (span.has(t_s[k])) out.add(y[k]);
  }
  return out;
}

// Nearest rank: a value that occurred, not more than share of all being larger than it.
double quantile(std::vector<double> y, double share) {
  if (y.empty()) return kAbsent;
  const auto rank = static_cast<std::size_t>(std::max(0.0, std::ceil(share * static_cast<double>(y.size())) - 1));
  std::nth_element(y.begin(), y.begin() + static_cast<std::ptrdiff_t>(rank), y.end());
  return y[rank];
}

void set_rms_and_peak(Metrics& out, std::string_view rms, std::string_view peak, const Statistics& s,
                      const std::string& because) {
  if (s.count == 0) {
    out.set_absent(rms, because);
    if (!peak.empty()) out.set_absent(peak, because);
    return;
  }
  out.set(rms, s.rms());
  if (!peak.empty()) out.set(peak, s.peak());
}

void free_motion(const AlignedSession& a, const scene::Scene& scene, Metrics& out) {
  set_rms_and_peak(out, "tracking_run_rms_rad", "tracking_run_peak_rad",
                   over(a.slave.t_s, a.tracking_rad, everything()),
                   "no tick with both sides engaged and a known delay");
  if (!scene.windows().has_free()) {
    for (const auto* key : {"tracking_rms_rad", "tracking_peak_rad", "drag_nms_per_rad"})
      out.set_absent(key, "the scene has no free window");
    return;
  }
  const Span window{scene.windows().free().from_s(), scene.windows().free().until_s()};
  const std::string nobody = "no tick of the free window with both sides engaged and a known delay";
  set_rms_and_peak(out, "tracking_rms_rad", "tracking_peak_rad", over(a.slave.t_s, a.tracking_rad, window), nobody);
  double power = 0, speed2 = 0;
  std::size_t count = 0;
  const SideCurves& m = a.master;
  for (std::size_t k = 0; k < m.t_s.size(); ++k) {
    if (!window.has(m.t_s[k]) || m.state[k] != kEngaged) continue;
    if (!std::isfinite(m.F_nm[k]) || !std::isfinite(m.v_rad_s[k])) continue;
    power += m.F_nm[k] * m.v_rad_s[k];
    speed2 += m.v_rad_s[k] * m.v_rad_s[k];
    ++count;
  }
  if (count > 0 && speed2 > kLeastMotion_rad_s * kLeastMotion_rad_s * static_cast<double>(count)) {
    out.set("drag_nms_per_rad", power / speed2);
  } else {
    out.set_absent("drag_nms_per_rad", count == 0 ? nobody : "the master did not move in the free window");
  }
}

// Where the hand exerts no torque. A wall alone pushes from where it begins.
double rest_angle(const scene::Slave& slave) {
  if (slave.has_hand()) return slave.hand().rest_rad();
  return slave.has_wall() ? slave.wall().at_rad() : kAbsent;
}

// Who moves the angle in this span without anything being wrong; empty if nobody does.
std::string moved_by_therapist(const scene::Therapist& therapist, const Span& span) {
  double from_s = 0;
  for (const scene::Movement& movement : therapist.intended()) {
    const double until_s = from_s + movement.duration_s();
    if (movement.sine_amplitude_rad() > 0 && from_s < span.until_s && until_s > span.from_s)
      return "the therapist swings to and fro at the end of the contact window";
    from_s = until_s;
  }
  return "";
}
std::string moved_by_patient(const scene::Slave& slave, const Span& span) {
  const scene::Hand& hand = slave.hand();
  if (!slave.has_hand() || hand.from_s() >= span.until_s || hand.until_s() <= span.from_s) return "";
  if (hand.rest_amplitude_rad() > 0) return "the patient moves by himself at the end of the contact window";
  return hand.tremor_nm() > 0 ? "the patient trembles at the end of the contact window" : "";
}

void steady_ratios(const AlignedSession& a, const scene::Scene& scene, const Span& window, Metrics& out) {
  const Span tail = tail_of(window);
  if (const std::string moved = moved_by_therapist(scene.master().therapist(), tail); !moved.empty()) {
    for (const auto* key : {"force_ratio", "k_seen_ratio"}) out.set_absent(key, moved);
    return;
  }
  const Statistics F_m = over(a.master.t_s, a.master.F_nm, tail), F_s = over(a.slave.t_s, a.slave.F_nm, tail);
  const Statistics x_m = over(a.master.t_s, a.master.x_rad, tail), x_s = over(a.slave.t_s, a.slave.x_rad, tail);
  if (F_m.count == 0 || F_s.count == 0) {
    for (const auto* key : {"force_ratio", "k_seen_ratio"})
      out.set_absent(key, "the run does not reach the end of the contact window");
    return;
  }
  if (std::abs(F_s.mean()) < kLeastTorque_nm) {
    for (const auto* key : {"force_ratio", "k_seen_ratio"})
      out.set_absent(key, "no torque on the hand at the end of the contact window");
    return;
  }
  out.set("force_ratio", F_m.mean() / (a.force_scale * F_s.mean()));
  const double rest = rest_angle(scene.slave()), depth_m = x_m.mean() - rest / a.position_scale,
               depth_s = x_s.mean() - rest;
  if (scene.slave().has_hand() && scene.slave().hand().rest_amplitude_rad() > 0) {
    out.set_absent("k_seen_ratio", "the patient moves by himself, so there is no one rest angle");
  } else if (!std::isfinite(rest)) {
    out.set_absent("k_seen_ratio", "nothing is in the orthosis, so there is no rest angle");
  } else if (!(std::abs(depth_m) >= kLeastAngle_rad && std::abs(depth_s) >= kLeastAngle_rad)) {
    out.set_absent("k_seen_ratio", "a side is at the rest angle at the end of the contact window");
  } else {
    out.set("k_seen_ratio", (F_m.mean() / depth_m) / (a.position_scale * a.force_scale * F_s.mean() / depth_s));
  }
}

bool engaged_throughout(const SideCurves& side, const Span& window) {
  for (std::size_t k = 0; k < side.t_s.size(); ++k) {
    if (window.has(side.t_s[k]) && side.state[k] != kEngaged) return false;
  }
  return true;
}

bool any_fault(const SideCurves& side) {
  return std::find(side.state.begin(), side.state.end(), kFault) != side.state.end();
}

bool covers(const SideCurves& side, const Span& window) {
  return !side.t_s.empty() && side.t_s.front() <= window.from_s + kGap_s && side.t_s.back() >= window.until_s - kGap_s;
}

void stability(const AlignedSession& a, const scene::Scene& scene, const Span& window, Metrics& out) {
  // A fault ends a run early: that is an answer and not a missing one.
  const bool fault = any_fault(a.master) || any_fault(a.slave);
  const bool whole = covers(a.master, window) && covers(a.slave, window);
  if (!whole) {
    out.set_absent("residual_p2p_rad", "the run does not cover the contact window");
    if (fault)
      out.set("stable", false);
    else
      out.set_absent("stable", "the run does not cover the contact window");
    return;
  }
  const bool engaged = !fault && engaged_throughout(a.master, window) && engaged_throughout(a.slave, window);
  std::string moved = moved_by_therapist(scene.master().therapist(), tail_of(window));
  if (moved.empty()) moved = moved_by_patient(scene.slave(), tail_of(window));
  if (!moved.empty()) {
    out.set_absent("residual_p2p_rad", moved);
    if (engaged)
      out.set_absent("stable", moved);
    else
      out.set("stable", false);
    return;
  }
  const auto residual = [&](const Span& span) {
    return std::fmax(over(a.master.t_s, a.master.x_rad, span).peak_to_peak(),
                     over(a.slave.t_s, a.slave.x_rad, span).peak_to_peak());
  };
  const double last = residual(tail_of(window)), before = residual(before_tail_of(window));
  out.set("residual_p2p_rad", last);
  out.set("stable", engaged && (last < kResidual_rad || last < 0.5 * before));
}

void contact(const AlignedSession& a, const scene::Scene& scene, Metrics& out) {
  if (!scene.windows().has_contact()) {
    for (const auto* key :
         {"force_error_rms_nm", "force_error_peak_nm", "force_error_delayed_rms_nm", "force_error_of_motion_rms_nm",
          "force_ratio", "k_seen_ratio", "residual_p2p_rad", "stable"}) {
      out.set_absent(key, "the scene has no contact window");
    }
    return;
  }
  const Span window{scene.windows().contact().from_s(), scene.windows().contact().until_s()};
  const std::string nobody = "no tick of the contact window with both sides engaged";
  set_rms_and_peak(out, "force_error_rms_nm", "force_error_peak_nm", over(a.master.t_s, a.force_error_nm, window),
                   nobody);
  set_rms_and_peak(out, "force_error_delayed_rms_nm", "", over(a.master.t_s, a.force_error_delayed_nm, window),
                   nobody + " and a known delay");
  set_rms_and_peak(out, "force_error_of_motion_rms_nm", "", over(a.slave.t_s, a.force_error_of_motion_nm, window),
                   nobody + " and a known delay");
  steady_ratios(a, scene, window, out);
  stability(a, scene, window, out);
}

// Force that the therapist feels although nothing touches the patient's side.
void phantom(const AlignedSession& a, const scene::Scene& scene, Metrics& out) {
  constexpr double kNothing_nm = 0.02, kCalm_s = 1.0, kMinute_s = 60.0;
  constexpr double kStop_rad = 0.01, kAfterStop_s = 0.3;  // a device that hits its stop swings for a moment
  constexpr std::size_t kSide = 10;                       // ticks on each side, over which v is differentiated
  const auto absent = [&](const std::string& because) {
    for (const auto* key : {"phantom_peak_nm", "phantom_late_peak_nm"}) out.set_absent(key, because);
  };
  if (!a.true_torque) return absent("the torques are estimates, which a reaction without a hand deceives");
  const SideCurves &m = a.master, &s = a.slave;
  const double K_f = scene.control().k_f_per_kgm2() / (a.position_scale * a.force_scale);
  const scene::Motor& motor = scene.master().motor();
  Statistics all, late;
  double calm_from_s = -std::numeric_limits<double>::infinity(), engaged_s = 0.0;
  std::size_t j = 0;
  for (std::size_t k = kSide; k + kSide < m.t_s.size(); ++k) {
    for (; j < s.t_s.size() && s.t_s[j] <= m.t_s[k]; ++j) {
      if (std::abs(s.F_nm[j]) <= kNothing_nm) continue;
      const double T_p = std::isfinite(m.playout_delay_s[k]) ? m.playout_delay_s[k] : 0.0;
      calm_from_s = s.t_s[j] + kCalm_s + 2 * T_p;
    }
    const bool at_stop = m.x_rad[k] < motor.stop_min_rad() + kStop_rad || m.x_rad[k] > motor.stop_max_rad() - kStop_rad;
    if (at_stop) calm_from_s = std::max(calm_from_s, m.t_s[k] + kAfterStop_s);
    if (j == 0 || m.state[k] != kEngaged || s.state[j - 1] != kEngaged) {
      calm_from_s = std::max(calm_from_s, m.t_s[k] + kCalm_s);  // what was blended in is not the model's
      continue;
    }
    engaged_s += m.dt_s[k];
    const double span_s = m.t_s[k + kSide] - m.t_s[k - kSide];
    if (m.t_s[k] < calm_from_s || span_s > kGap_s) continue;
    const double phantom_nm = m.F_nm[k] - (m.v_rad_s[k + kSide] - m.v_rad_s[k - kSide]) / span_s / K_f;
    all.add(phantom_nm);
    if (engaged_s > kMinute_s) late.add(phantom_nm);
  }
  if (all.count == 0) return absent("the hand bore torque at every tick with both sides engaged");
  out.set("phantom_peak_nm", all.peak());
  if (late.count > 0) {
    out.set("phantom_late_peak_nm", late.peak());
  } else {
    out.set_absent("phantom_late_peak_nm", "no such tick after the first minute");
  }
}

void whole_run(const Session& session, const scene::Scene& scene, const AlignedSession& a, Metrics& out) {
  // Time: both sides engaged, and held without a request.
  double engaged_s = 0;
  for (std::size_t k = 0, j = 0; k < a.master.t_s.size() && !a.slave.t_s.empty(); ++k) {
    while (j + 1 < a.slave.t_s.size() && a.slave.t_s[j + 1] <= a.master.t_s[k]) ++j;
    const bool peer_here = std::abs(a.master.t_s[k] - a.slave.t_s[j]) <= kGap_s;
    if (peer_here && a.master.state[k] == kEngaged && a.slave.state[j] == kEngaged) engaged_s += a.master.dt_s[k];
  }
  out.set("engaged_s", engaged_s);
  out.set("held_s", unwanted_hold_s(session, scene));

  // Largest torques and speed, to compare with the limits of the scene.
  const auto largest = [&](std::string_view key, const Statistics& s) {
    if (s.count == 0)
      out.set_absent(key, "nothing was recorded");
    else
      out.set(key, s.peak());
  };
  Statistics command_m, command_s, v, depth_ms;
  for (const StationSample& s : session.master) command_m.add(s.command_nm);
  for (const StationSample& s : session.slave) command_s.add(s.command_nm);
  for (const auto* side : {&a.master, &a.slave}) {
    for (const double y : side->v_rad_s) v.add(y);
  }
  largest("torque_max_master_nm", command_m);
  largest("torque_max_slave_nm", command_s);
  largest("velocity_max_rad_s", v);

  // Energy: below 0 a side, or the whole teleoperator, gave more than it took. The slave's energy is scaled to the
  // master's size.
  const Statistics E_m = over(a.master.t_s, a.energy_master_j, everything()),
                   E_s = over(a.slave.t_s, a.energy_slave_j, everything());
  Statistics both;
  Walk at_slave(a.slave.t_s);
  for (std::size_t k = 0; k < a.master.t_s.size(); ++k)
    both.add(a.energy_master_j[k] +
             a.force_scale / a.position_scale * at_slave.interpolate(a.energy_slave_j, a.master.t_s[k]));
  const auto least = [&](std::string_view key, const Statistics& s) {
    if (s.count == 0)
      out.set_absent(key, "nothing was recorded");
    else
      out.set(key, s.least);
  };
  least("energy_min_master_j", E_m);
  least("energy_min_slave_j", E_s);
  least("energy_min_both_j", both);
  phantom(a, scene, out);

  // The laws' own accounts of energy, while engaged.
  const auto account = [&](std::string_view key, const std::vector<StationSample>& rows,
                           const std::vector<std::string>& signals) {
    Statistics s;
    for (const StationSample& row : rows) {
      const double energy_j = law_signal(row, signals, "energy_j");
      if (row.state == kEngaged && std::isfinite(energy_j)) s.add(energy_j);
    }
    if (s.count == 0)
      out.set_absent(key, "the scene keeps no account of energy");
    else
      out.set(key, s.least);
  };
  account("account_min_master_j", session.master, session.master_signals);
  account("account_min_slave_j", session.slave, session.slave_signals);

  // Estimates of the laws count with their last value, when most has been learnt.
  const auto last = [&](std::string_view key, std::string_view signal, double scale, const std::string& because) {
    double value = kAbsent;
    for (auto row = session.master.rbegin(); row != session.master.rend() && !std::isfinite(value); ++row)
      value = law_signal(*row, session.master_signals, signal) / scale;
    if (std::isfinite(value))
      out.set(key, value);
    else
      out.set_absent(key, because);
  };
  last("friction_identified_nm", "friction_nm", 1.0, "the scene has no mediator");
  last("f_2_identified_nm", "f_2_nm", a.force_scale, "the thresholds of SDCV are not the patient's");
}

// Of the patient's device, as the box took it.
void friction(const DeviceFriction& box, Metrics& out) {
  if (std::isnan(box.threshold_nm)) {
    for (const auto* key : {"friction_threshold_nm", "friction_measured_nm", "friction_spread_nm", "friction_source"})
      out.set_absent(key, "the box did not record it");
    return;
  }
  out.set("friction_threshold_nm", box.threshold_nm);
  out.set("friction_source", friction_source(box));
  for (const auto& [key, value] :
       {std::pair{"friction_measured_nm", box.F_c_nm}, std::pair{"friction_spread_nm", box.spread_nm}}) {
    if (std::isfinite(value))
      out.set(key, value);
    else
      out.set_absent(key, "it was never measured without a hand");
  }
}

void set_share(Metrics& out, std::string_view key, double part, double whole, const std::string& because) {
  if (whole > 0)
    out.set(key, part / whole);
  else
    out.set_absent(key, because);
}

void network(const Session& session, const AlignedSession& a, Metrics& out) {
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

void wall_clock(const Session& session, Metrics& out) {
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

}  // namespace

Metrics compute_metrics(const Session& session, const scene::Scene& scene) {
  Metrics out;
  const AlignedSession aligned = align(session, scene);
  out.set("scene", session.scene_name);
  out.set("seed", session.seed);
  out.set("force_source", std::string(aligned.true_torque ? "true" : "estimated"));
  out.set("angle_source", std::string(aligned.true_angle ? "true" : "estimated"));
  out.set("clock_offset_bound_ms", 1e3 * session.clock_offset_bound_s);
  whole_run(session, scene, aligned, out);
  free_motion(aligned, scene, out);
  contact(aligned, scene, out);
  friction(session.friction, out);
  network(session, aligned, out);
  wall_clock(session, out);

  const Judgement judgement = judge(session, scene, out);
  out.set("verdict", std::string(name_of(judgement.verdict)));
  out.set("reasons", judgement.reasons);
  std::vector<std::string> absent;
  for (const Metric& metric : out.all()) {
    const bool missing = std::holds_alternative<std::monostate>(metric.value);
    if (missing && metric.info->deterministic && metric.info->key != "absent")
      absent.push_back(std::string(metric.info->key) + ": " + metric.absent_because);
  }
  out.set("absent", std::move(absent));
  return out;
}

}  // namespace farhand
