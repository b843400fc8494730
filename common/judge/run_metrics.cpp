// Metrics of the whole run.
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "common/judge/friction_source.hpp"
#include "common/judge/metric_parts.hpp"
#include "common/judge/statistics.hpp"
#include "common/judge/verdict.hpp"
#include "common/link/packet.hpp"

namespace farhand {
namespace {

constexpr int kEngaged = static_cast<int>(StationState::kEngaged);

}  // namespace

void phantom_metrics(const AlignedSession& a, const scene::Scene& scene, Metrics& out) {
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

void run_metrics(const Session& session, const scene::Scene& scene, const AlignedSession& a, Metrics& out) {
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

void friction_metrics(const DeviceFriction& box, Metrics& out) {
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

}  // namespace farhand
