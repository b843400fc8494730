// Metrics of free motion and of contact.
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "common/judge/metric_parts.hpp"
#include "common/judge/statistics.hpp"
#include "common/link/packet.hpp"

namespace farhand {
namespace {

constexpr int kEngaged = static_cast<int>(StationState::kEngaged);
constexpr int kFault = static_cast<int>(StationState::kFault);

constexpr double kResidual_rad = 0.005;   // less than this at rest is stable without further questions
constexpr double kLeastTorque_nm = 1e-3;  // below these a ratio is only noise over noise
constexpr double kLeastAngle_rad = 1e-3;
constexpr double kLeastMotion_rad_s = 1e-6;

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

}  // namespace

void free_motion_metrics(const AlignedSession& a, const scene::Scene& scene, Metrics& out) {
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

void contact_metrics(const AlignedSession& a, const scene::Scene& scene, Metrics& out) {
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

}  // namespace farhand
