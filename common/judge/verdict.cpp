#include "common/judge/verdict.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "common/judge/alignment.hpp"
#include "common/judge/digits.hpp"
#include "common/link/packet.hpp"
#include "common/record/harder_tendons.hpp"

namespace farhand {
namespace {

constexpr double kOverrunLimit = 0.01, kMissedLimit = 0.01;
// A side that ran for this share of the scene's duration came to its end; a process may start a little before or after
// the other.
constexpr double kWholeRun = 0.98;
// Holding that starts this long before a side's peer comes to its end is part of ending: the last packets are still on
// the way.
constexpr double kEnding_s = 0.05;

constexpr int kEngaged = static_cast<int>(StationState::kEngaged);
constexpr int kHolding = static_cast<int>(StationState::kHolding);
constexpr int kFault = static_cast<int>(StationState::kFault);

bool whole(const std::vector<StationSample>& side, const scene::Scene& scene) {
  return !side.empty() && side.back().t_s - side.front().t_s >= kWholeRun * scene.duration_s();
}

// From HOLD or STOP to the next ENGAGE. The live operator leaves events; the timeline of a scene leaves its acts.
std::vector<std::pair<double, double>> operator_holds(const Session& session, const scene::Scene& scene) {
  std::vector<std::pair<double, bool>> acts;  // time, engages
  for (const scene::OperatorAct& act : scene.operator_acts()) {
    if (act.act() == scene::ENGAGE || act.act() == scene::HOLD || act.act() == scene::STOP)
      acts.emplace_back(act.at_s(), act.act() == scene::ENGAGE);
  }
  for (const SessionEvent& event : session.events) {
    for (const auto* word : {"operator: engage", "operator: hold", "operator: stop"}) {
      if (event.text.rfind(word, 0) == 0) acts.emplace_back(event.t_s, std::string_view(word) == "operator: engage");
    }
  }
  std::sort(acts.begin(), acts.end());
  std::vector<std::pair<double, double>> holds;
  bool held = false;
  for (const auto& [t_s, engages] : acts) {
    if (!engages && !held) holds.emplace_back(t_s, std::numeric_limits<double>::infinity());
    if (engages && held) holds.back().second = t_s;
    held = !engages;
  }
  return holds;
}

double hold_of_side(const std::vector<StationSample>& side, const std::vector<StationSample>& peer,
                    const scene::Scene& scene, const std::vector<std::pair<double, double>>& wanted) {
  const double peer_end_s = whole(peer, scene) ? peer.back().t_s - kEnding_s : std::numeric_limits<double>::infinity();
  double held_s = 0;
  bool engaged_before = false, counts = false;
  int last = -1;
  for (std::size_t k = 0; k + 1 < side.size(); ++k) {
    const StationSample& s = side[k];
    if (s.state == kEngaged) engaged_before = true;
    // Why a hold began is known when it begins, so the whole of it counts or none.
    if (s.state == kHolding && last != kHolding) {
      counts = engaged_before && s.t_s < peer_end_s &&
               std::none_of(wanted.begin(), wanted.end(),
                            [&](const auto& hold) { return s.t_s >= hold.first && s.t_s <= hold.second; });
    }
    if (s.state == kHolding && counts) held_s += std::clamp(side[k + 1].t_s - s.t_s, 0.0, kGap_s);
    last = s.state;
  }
  return held_s;
}

bool any_fault(const std::vector<StationSample>& side) {
  return std::any_of(side.begin(), side.end(), [](const StationSample& s) { return s.state == kFault; });
}

// What a PC did to its own side; empty if it kept time.
std::string kept_from_time(std::string_view who, const std::vector<StationSample>& side,
                           const StationCounters& counters) {
  const double missed = missed_share(counters), gap_s = longest_gap_s(side, counters);
  std::string said;
  if (missed > kMissedLimit) said = "missed " + three_digits(100 * missed) + " % of its ticks";
  if (counters.missed_ticks > 0 && gap_s > kGap_s)
    said += (said.empty() ? "stood still for " : " and stood still for up to ") + three_digits(1e3 * gap_s) + " ms";
  return said.empty() ? said
                      : "The PC of the " + std::string(who) + " " + said + ": nothing is said about the controller.";
}

// A shorter gap says nothing against a session, but may be why it moved: common/station/after_gap.hpp.
std::string moved_by_gap(std::string_view who, const std::vector<StationSample>& side,
                         const StationCounters& counters) {
  constexpr double kFelt_s = 0.005;
  const double gap_s = longest_gap_s(side, counters);
  if (counters.missed_ticks == 0 || !(gap_s >= kFelt_s)) return {};
  return "The PC of the " + std::string(who) + " stood still for up to " + three_digits(1e3 * gap_s) +
         " ms: for a second after that less of the peer is followed.";
}

void judge_side(std::string_view who, const std::vector<StationSample>& side, const scene::Scene& scene,
                std::vector<std::string>& failed, std::vector<std::string>& degraded) {
  const std::string name(who);
  if (side.empty()) {
    failed.push_back("Nothing was recorded by the " + name + ".");
    return;
  }
  const auto fault = std::find_if(side.begin(), side.end(), [](const StationSample& s) { return s.state == kFault; });
  if (fault != side.end()) failed.push_back("The " + name + " went into fault at " + three_digits(fault->t_s) + " s.");
  if (!whole(side, scene)) {
    degraded.push_back("The recording of the " + name + " covers " + three_digits(side.back().t_s - side.front().t_s) +
                       " s of " + three_digits(scene.duration_s()) + " s.");
  }
}

// Empty if they do not, or if nothing was measured without the hand.
std::string harder_tendons(const Session& session, const scene::Scene& scene) {
  if (!session.friction.measured || !std::isfinite(session.friction.F_c_nm)) return {};
  const double scale = scene.control().has_force_scale() ? scene.control().force_scale() : 1.0;
  double most = 0;
  for (const StationSample& row : session.master) {
    if (row.state == kEngaged)
      most = std::fmax(most, law_signal(row, session.master_signals, HarderTendons::kSignal) / scale);
  }
  if (!(most > session.friction.F_c_nm + HarderTendons::kHarder)) return {};
  return "The tendons run harder than at the fitting: friction of " + three_digits(most) + " N m, and " +
         three_digits(session.friction.F_c_nm) + " N m without the hand.";
}

}  // namespace

std::string_view name_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::kOk:
      return "ok";
    case Verdict::kDegraded:
      return "degraded";
    case Verdict::kFailed:
      return "failed";
  }
  return "failed";
}

double missed_share(const StationCounters& counters) {
  const double due = static_cast<double>(counters.ticks + counters.missed_ticks);
  return due > 0 ? static_cast<double>(counters.missed_ticks) / due : kAbsent;
}

double longest_gap_s(const std::vector<StationSample>& rows, const StationCounters& counters) {
  if (rows.size() < 2 || counters.record_overflow + counters.record_unwritten > 0) return kAbsent;
  double longest = 0;
  for (std::size_t k = 1; k < rows.size(); ++k) longest = std::max(longest, rows[k].t_s - rows[k - 1].t_s);
  return longest;
}

double unwanted_hold_s(const Session& session, const scene::Scene& scene) {
  const auto wanted = operator_holds(session, scene);
  return std::max(hold_of_side(session.master, session.slave, scene, wanted),
                  hold_of_side(session.slave, session.master, scene, wanted));
}

Judgement judge(const Session& session, const scene::Scene& scene, const Metrics& metrics) {
  std::vector<std::string> late, failed, degraded;
  for (const std::string& pc : {kept_from_time("master", session.master, session.master_counters),
                                kept_from_time("slave", session.slave, session.slave_counters)}) {
    if (!pc.empty()) late.push_back(pc);
  }
  judge_side("master", session.master, scene, failed, degraded);
  judge_side("slave", session.slave, scene, failed, degraded);
  if (!(metrics.number("engaged_s") > 0)) failed.push_back("The two sides were never engaged together.");
  if (metrics.is_false("stable") && late.empty()) {
    for (const std::string& pc : {moved_by_gap("master", session.master, session.master_counters),
                                  moved_by_gap("slave", session.slave, session.slave_counters)}) {
      if (!pc.empty()) failed.push_back(pc);
    }
    const double residual = metrics.number("residual_p2p_rad");
    const bool fault = any_fault(session.master) || any_fault(session.slave);
    failed.push_back(std::isfinite(residual)
                         ? "Contact was not stable: the angle still moved by " + three_digits(1e3 * residual) +
                               " mrad in the last 2 s of the contact window, or a side left engagement in it."
                         : "Contact was not stable: " +
                               std::string(fault ? "it ended in a fault." : "a side left engagement in it."));
  }
  const auto above = [&](std::string_view key, bool judged, double limit, double scale, const std::string& what,
                         const std::string& unit) {
    const double value = metrics.number(key);
    if (judged && value > limit) {
      degraded.push_back(what + " " + three_digits(scale * value) + unit + ", above the limit of " +
                         three_digits(scale * limit) + unit + ".");
    }
  };
  const scene::Windows& windows = scene.windows();
  above("tracking_rms_rad", windows.has_degraded_tracking_rad(), windows.degraded_tracking_rad(), 1e3,
        "Tracking in free motion was off by an RMS of", " mrad");
  above("late", windows.has_degraded_late(), windows.degraded_late(), 100,
        "Packets that came too late for their play-out:", " %");
  above("overruns", true, kOverrunLimit, 100, "Ticks that took longer than their period:", " %");
  if (const std::string harder = harder_tendons(session, scene); !harder.empty()) degraded.push_back(harder);
  if (metrics.number("held_s") > 0) {
    degraded.push_back("A side held for " + three_digits(metrics.number("held_s")) +
                       " s without its operator's asking; the events say why.");
  }

  Judgement out;
  const bool well = late.empty() && degraded.empty();
  out.verdict = !failed.empty() ? Verdict::kFailed : well ? Verdict::kOk : Verdict::kDegraded;
  out.reasons = std::move(late);
  out.reasons.insert(out.reasons.end(), failed.begin(), failed.end());
  out.reasons.insert(out.reasons.end(), degraded.begin(), degraded.end());
  return out;
}

}  // namespace farhand
