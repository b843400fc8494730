#include "common/show/figures.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "common/judge/digits.hpp"
#include "common/law/architectures.hpp"
#include "common/link/packet.hpp"
#include "common/station/engagement.hpp"

namespace farhand {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr double kRunning_s = 1.0;      // the running RMS looks back this far
constexpr std::size_t kMaxMarked = 40;  // more events would paint the pictures over; the table lists the rest
constexpr std::size_t kBins = 60;

std::vector<double> times(const std::vector<StationSample>& samples) {
  std::vector<double> out;
  for (const StationSample& s : samples) out.push_back(s.t_s);
  return out;
}

template <class Value>
std::vector<double> each(const std::vector<StationSample>& samples, Value value) {
  std::vector<double> out;
  for (const StationSample& s : samples) out.push_back(value(s));
  return out;
}

std::vector<double> scaled(std::vector<double> y, double factor) {
  for (double& v : y) v *= factor;
  return y;
}

// A recording may hold any number.
const char* state_name(int state) {
  const bool known = state >= 0 && state <= static_cast<int>(kLastState);
  return known ? name_of(static_cast<StationState>(state)) : "unknown";
}

Lanes::Stretch state_stretch(int state, double from, double until) {
  switch (static_cast<StationState>(state)) {
    case StationState::kReady:
      return {from, until, "#bdbdbd", 0.15, ""};
    case StationState::kAligning:
      return {from, until, "#6baed6", 0.5, ""};
    case StationState::kEngaged:
      return {from, until, "#9ecae1", 1, "engaged"};
    case StationState::kHolding:
      return {from, until, "#e6700b", 0.75, "holding"};
    case StationState::kFault:
      return {from, until, "#111111", 1, ""};
    case StationState::kOff:
      return {from, until, "#ffffff", 1, ""};
    case StationState::kSelfTest:
      return {from, until, "#dadaeb", 1, ""};
    case StationState::kHoming:
      return {from, until, "#9e9ac8", 1, "homing"};
    case StationState::kIdentifying:
      return {from, until, "#bcbddc", 1, "identifying"};
    case StationState::kSweeping:
      return {from, until, "#bcbddc", 1, "sweeping"};
    case StationState::kStopped:
      return {from, until, "#a50f15", 1, "stopped"};
  }
  return {from, until, "#111111", 1, ""};
}

// Stretches over which `value` keeps one value; a hole in the recording ends a stretch.
template <class Value, class Make>
std::vector<Lanes::Stretch> stretches(const std::vector<StationSample>& samples, Value value, Make make) {
  std::vector<Lanes::Stretch> out;
  std::size_t first = 0;
  for (std::size_t k = 1; k <= samples.size(); ++k) {
    const bool hole = k < samples.size() && samples[k].t_s - samples[k - 1].t_s > kGap_s;
    if (k < samples.size() && !hole && value(samples[k]) == value(samples[first])) continue;
    const bool ends = k == samples.size() || hole;
    make(out, value(samples[first]), samples[first].t_s, ends ? samples[k - 1].t_s : samples[k].t_s);
    first = k;
  }
  return out;
}

std::vector<double> running_rms(const std::vector<double>& t_s, const std::vector<double>& y) {
  std::vector<double> out(y.size(), kAbsent);
  // Differences of prefix sums: long double keeps what a large peak long ago would otherwise wipe out.
  std::vector<long double> squares(y.size() + 1, 0);
  std::vector<std::size_t> counts(y.size() + 1, 0);
  for (std::size_t k = 0; k < y.size(); ++k) {
    const bool known = std::isfinite(y[k]);
    squares[k + 1] = squares[k] + (known ? static_cast<long double>(y[k]) * y[k] : 0);
    counts[k + 1] = counts[k] + (known ? 1 : 0);
  }
  for (std::size_t k = 0, first = 0; k < y.size(); ++k) {
    while (t_s[first] < t_s[k] - kRunning_s) ++first;
    const std::size_t count = counts[k + 1] - counts[first];
    if (std::isfinite(y[k]) && count > 0) {
      out[k] = static_cast<double>(
          std::sqrt(std::max(0.0L, squares[k + 1] - squares[first]) / static_cast<long double>(count)));
    }
  }
  return out;
}

std::vector<double> peak_so_far(const std::vector<double>& y) {
  std::vector<double> out(y.size(), kAbsent);
  double peak = kAbsent;
  for (std::size_t k = 0; k < y.size(); ++k) {
    if (std::isfinite(y[k])) peak = std::fmax(peak, std::abs(y[k]));
    out[k] = std::isfinite(y[k]) ? peak : kAbsent;
  }
  return out;
}

struct Delays {
  std::vector<double> t_s, asked_ms, achieved_ms;  // packets that arrived
};

Delays delays_of(const Session& session, bool forward) {
  Delays out;
  for (const LinkSample& p : session.link) {
    if (p.forward != forward || p.lost || !std::isfinite(p.achieved_delay_s) || !std::isfinite(p.t_s)) continue;
    out.t_s.push_back(p.t_s);
    out.asked_ms.push_back(1e3 * p.asked_delay_s);
    out.achieved_ms.push_back(1e3 * p.achieved_delay_s);
  }
  return out;
}

const char* way(bool forward) { return forward ? "master to slave" : "slave to master"; }

std::vector<SessionEvent> events_of(const Session& session) {
  std::vector<SessionEvent> out = session.events;
  if (out.empty()) {
    for (const auto& [name, side] : {std::pair("master", &session.master), std::pair("slave", &session.slave)}) {
      for (std::size_t k = 1; k < side->size(); ++k) {
        if ((*side)[k].state != (*side)[k - 1].state)
          out.push_back({(*side)[k].t_s, name, state_name((*side)[k].state)});
      }
    }
  }
  std::stable_sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.t_s < b.t_s; });
  return out;
}

}  // namespace

Figures::Figures(const Session& session, const scene::Scene& scene)
    : session_(session), scene_(scene), aligned_(align(session, scene)), events_(events_of(session)) {
  double from = std::numeric_limits<double>::infinity(), until = -from;
  for (const auto* side : {&aligned_.master.t_s, &aligned_.slave.t_s}) {
    if (side->empty()) continue;
    from = std::min(from, side->front());
    until = std::max(until, side->back());
  }
  if (!(until > from)) from = 0, until = 1;
  time_ = {"time (s)", from, until};
  if (scene.windows().has_free())
    landmarks_.windows.push_back({scene.windows().free().from_s(), scene.windows().free().until_s(), "free window"});
  if (scene.windows().has_contact()) {
    landmarks_.windows.push_back(
        {scene.windows().contact().from_s(), scene.windows().contact().until_s(), "contact window"});
  }
  for (std::size_t k = 0; k < std::min(events_.size(), kMaxMarked); ++k) {
    const SessionEvent& event = events_[k];
    landmarks_.events.push_back(
        {event.t_s, std::to_string(k + 1), three_digits(event.t_s) + " s, " + event.who + ": " + event.text});
  }
}

Plot Figures::over_time(const std::string& title, const std::string& y_label, double height) const {
  Plot plot(title, time_, {y_label}, 960, height);
  plot.landmarks(landmarks_);
  return plot;
}

std::string Figures::positions() const {
  Plot plot = over_time("Angle", "angle (rad)", 264);
  plot.right_axis("degrees", kDegrees);
  plot.line("master x_m", aligned_.master.t_s, aligned_.master.x_rad, Ink::kMaster, kGap_s);
  plot.line("slave x_s", aligned_.slave.t_s, aligned_.slave.x_rad, Ink::kSlave, kGap_s);
  return plot.svg();
}

std::string Figures::torques() const {
  Plot plot = over_time(aligned_.true_torque ? "Torque, true" : "Torque, estimated", "torque (N m)", 264);
  plot.line("therapist on device F_m", aligned_.master.t_s, aligned_.master.F_nm, Ink::kMaster, kGap_s);
  plot.line("device on hand F_s", aligned_.slave.t_s, aligned_.slave.F_nm, Ink::kSlave, kGap_s);
  return plot.svg();
}

std::string Figures::states() const {
  Lanes lanes("State of the two stations", time_);
  lanes.landmarks(landmarks_);
  const auto make = [](auto& out, int state, double from, double until) {
    out.push_back(state_stretch(state, from, until));
  };
  for (const auto& [name, side] : {std::pair("master", &session_.master), std::pair("slave", &session_.slave)}) {
    lanes.lane(name, stretches(
                         *side, [](const StationSample& s) { return s.state; }, make));
  }
  return lanes.svg();
}

std::string Figures::delays(bool forward) const {
  const Delays d = delays_of(session_, forward);
  if (d.t_s.empty()) return "";
  Plot plot = over_time(std::string("One-way delay, ") + way(forward), "delay (ms)", 214);
  plot.range("asked, least to greatest", d.t_s, d.asked_ms, forward ? Ink::kMasterPale : Ink::kSlavePale, true);
  plot.range("achieved, least and greatest", d.t_s, d.achieved_ms, Ink::kBlack, false);
  return plot.svg();
}

std::string Figures::losses() const {
  Lanes lanes("Lost packets", time_);
  lanes.landmarks(landmarks_);
  for (const bool forward : {true, false}) {
    std::vector<Lanes::Stretch> lost;
    for (const LinkSample& p : session_.link) {
      if (p.forward == forward && p.lost) lost.push_back({p.t_s, p.t_s, "#111111", 1, ""});
    }
    lanes.lane(forward ? "forward" : "backward", std::move(lost));
  }
  return lanes.svg();
}

std::string Figures::delay_histogram() const {
  const Delays ways[] = {delays_of(session_, true), delays_of(session_, false)};
  double from = std::numeric_limits<double>::infinity(), until = -from;
  for (const Delays& d : ways) {
    for (const double y : d.achieved_ms) from = std::min(from, y), until = std::max(until, y);
  }
  if (!(from <= until)) return "";
  if (until - from < 1) from -= 0.5, until += 0.5;  // a constant delay is a bar, not a line of no width
  Plot plot("Delay achieved, histogram", {"delay (ms)"}, {"share of packets (%)", 0}, 475, 280);
  for (const bool forward : {true, false}) {
    const Delays& d = ways[forward ? 0 : 1];
    std::vector<double> edges, heights(kBins, 0);
    for (std::size_t k = 0; k <= kBins; ++k) edges.push_back(from + (until - from) * static_cast<double>(k) / kBins);
    for (const double y : d.achieved_ms) {
      heights[std::min(kBins - 1, static_cast<std::size_t>((y - from) / (until - from) * kBins))] +=
          100 / static_cast<double>(d.achieved_ms.size());
    }
    plot.bars(forward ? "forward" : "backward", std::move(edges), std::move(heights),
              forward ? Ink::kMaster : Ink::kSlave, forward);
  }
  return plot.svg();
}

std::string Figures::delay_distribution() const {
  Plot plot("Delay, empirical distribution", {"delay (ms)"}, {"packets up to this delay (%)", 0, 100}, 475, 280);
  bool any = false;
  for (const bool forward : {true, false}) {
    const Delays d = delays_of(session_, forward);
    if (d.t_s.empty()) continue;
    any = true;
    const auto distribution = [&](const std::string& label, std::vector<double> y, Ink ink) {
      std::sort(y.begin(), y.end());
      std::vector<double> share;
      for (std::size_t k = 0; k < y.size(); ++k)
        share.push_back(100 * static_cast<double>(k + 1) / static_cast<double>(y.size()));
      // A step function is drawn from 0: a constant delay would otherwise be a single point.
      y.insert(y.begin(), y.front());
      share.insert(share.begin(), 0);
      plot.line(label, std::move(y), std::move(share), ink);
    };
    distribution(forward ? "forward" : "backward", d.achieved_ms, forward ? Ink::kMaster : Ink::kSlave);
    distribution(forward ? "forward asked" : "backward asked", d.asked_ms,
                 forward ? Ink::kMasterPale : Ink::kSlavePale);
  }
  return any ? plot.svg() : "";
}

std::string Figures::round_trip_and_playout() const {
  Plot plot = over_time("Play-out buffer and round trip", "time (ms)", 234);
  const auto depth_ms = [](const StationSample& s) { return 1e3 * s.playout_delay_s; };
  plot.line("round trip at the master", times(session_.master),
            each(session_.master, [](const StationSample& s) { return s.rtt_s > 0 ? 1e3 * s.rtt_s : kAbsent; }),
            Ink::kGrey, kGap_s);
  plot.line("depth, master", times(session_.master), each(session_.master, depth_ms), Ink::kMaster, kGap_s);
  plot.line("depth, slave", times(session_.slave), each(session_.slave, depth_ms), Ink::kSlave, kGap_s);
  return plot.svg();
}

std::string Figures::compensation() const {
  const std::vector<double> y = each(session_.master, [](const StationSample& s) { return 1e3 * s.x_cdob_rad; });
  if (std::none_of(y.begin(), y.end(), [](double v) { return std::isfinite(v) && v != 0; })) return "";
  Plot plot = over_time("The slave as predicted, beyond what was received", "x_p - x_received (x_cdob), mrad", 204);
  plot.line("x_p - x_received", times(session_.master), y, Ink::kMaster, kGap_s);
  return plot.svg();
}

std::string Figures::alpha() const {
  const std::vector<double> y = each(session_.master, [](const StationSample& s) { return s.alpha; });
  if (std::none_of(y.begin(), y.end(), [](double v) { return std::isfinite(v) && v != 1; })) return "";
  Plot plot("Share of the compensation that is used", time_, {"alpha", -0.05, 1.05}, 960, 184);
  plot.landmarks(landmarks_);
  plot.line("alpha", times(session_.master), y, Ink::kMaster, kGap_s);
  return plot.svg();
}

std::string Figures::law_signals() const {
  const Architecture* laws = find_architecture(scene::Architecture_Name(scene_.architecture()));
  std::vector<std::string> names = session_.master_signals;
  for (const std::string& name : session_.slave_signals) {
    if (std::ranges::find(names, name) == names.end()) names.push_back(name);
  }
  std::string all;
  for (const std::string& name : names) {
    const LawSignal* signal = laws == nullptr ? nullptr : signal_of(*laws, name);
    Plot plot = over_time(signal == nullptr ? name : name + ": " + std::string(signal->meaning),
                          signal == nullptr || signal->unit == "1" ? name : std::string(signal->unit), 184);
    bool any = false;
    const auto line = [&](const char* label, const std::vector<StationSample>& rows,
                          const std::vector<std::string>& signals, Ink ink) {
      const std::vector<double> y = each(rows, [&](const StationSample& s) { return law_signal(s, signals, name); });
      if (std::none_of(y.begin(), y.end(), [](double v) { return std::isfinite(v); })) return;
      any = true;
      plot.line(label, times(rows), y, ink, kGap_s);
    };
    line("master", session_.master, session_.master_signals, Ink::kMaster);
    line("slave", session_.slave, session_.slave_signals, Ink::kSlave);
    if (any) all += plot.svg();
  }
  return all;
}

std::string Figures::error_over_time(const std::string& title, const std::string& y_label,
                                     const std::vector<double>& t_s, const std::vector<double>& error,
                                     double limit) const {
  Plot plot = over_time(title, y_label, 264);
  plot.line("error", t_s, error, Ink::kGrey, kGap_s);
  plot.line("RMS of the last 1 s", t_s, running_rms(t_s, error), Ink::kMaster, kGap_s);
  plot.line("peak so far", t_s, peak_so_far(error), Ink::kSlave, kGap_s);
  const auto worst = std::max_element(error.begin(), error.end(), [](double a, double b) {
    return std::isfinite(b) && (!std::isfinite(a) || std::abs(a) < std::abs(b));
  });
  if (worst != error.end() && std::isfinite(*worst)) {
    plot.points("largest", {t_s[static_cast<std::size_t>(worst - error.begin())]}, {*worst}, Ink::kBlack,
                Symbol::kCircle);
  }
  // A limit far above the data would press the curves flat; the first screen states it anyway.
  double peak = 0;
  for (const double e : error) peak = std::isfinite(e) ? std::max(peak, std::abs(e)) : peak;
  if (limit <= 3 * peak) plot.rule(limit, "limit of the RMS");
  return plot.svg();
}

std::string Figures::tracking_error() const {
  const double limit =
      scene_.windows().has_degraded_tracking_rad() ? 1e3 * scene_.windows().degraded_tracking_rad() : kAbsent;
  return error_over_time("Tracking error x_s(t) - x_m(t - T_p)", "error (mrad)", aligned_.slave.t_s,
                         scaled(aligned_.tracking_rad, 1e3), limit);
}

std::string Figures::estimated_torques() const {
  if (!aligned_.true_torque) return "";
  Plot plot = over_time("Torque, true and as estimated", "torque (N m)");
  plot.line("F_m true", aligned_.master.t_s, aligned_.master.F_nm, Ink::kMaster, kGap_s);
  plot.line("F_s true", aligned_.slave.t_s, aligned_.slave.F_nm, Ink::kSlave, kGap_s);
  plot.line("-f_m estimated", aligned_.master.t_s, scaled(aligned_.master.f_nm, -1), Ink::kMasterPale, kGap_s);
  plot.line("f_s estimated", aligned_.slave.t_s, aligned_.slave.f_nm, Ink::kSlavePale, kGap_s);
  return plot.svg();
}

std::string Figures::force_error() const {
  return error_over_time("Force error F_m(t) - F_s(t)", "error (N m)", aligned_.master.t_s, aligned_.force_error_nm,
                         kAbsent);
}

std::string Figures::torque_against_angle() const {
  Plot plot(aligned_.true_torque ? "Torque against angle, true" : "Torque against angle, estimated torque",
            {"angle (degrees)"}, {"torque (N m)"}, 760, 460);
  const auto loop = [&](const std::string& label, const SideCurves& side, Ink ink) {
    std::vector<double> F = side.F_nm;
    for (std::size_t k = 0; k < F.size(); ++k) {
      const bool engaged = side.state[k] == static_cast<int>(StationState::kEngaged);
      if (!engaged || (k > 0 && side.t_s[k] - side.t_s[k - 1] > kGap_s)) F[k] = kAbsent;
    }
    plot.loop(label, scaled(side.x_rad, kDegrees), std::move(F), ink);
  };
  loop("therapist F_m over x_m", aligned_.master, Ink::kMaster);
  loop("hand F_s over x_s", aligned_.slave, Ink::kSlave);
  return plot.svg();
}

std::string Figures::limits() const {
  Lanes lanes("Limits that acted", time_);
  lanes.landmarks(landmarks_);
  bool any = false;
  for (const auto& [side_name, side, fill] :
       {std::tuple("m", &session_.master, "#08519c"), std::tuple("s", &session_.slave, "#e6700b")}) {
    for (const auto& [bit, name] : kLimitNames) {
      // What acts is full, what is only near is pale.
      const auto make = [&, colour = fill](auto& out, int acts, double from, double until) {
        if (acts > 0) out.push_back({from, until, colour, acts > 1 ? 1 : 0.3, ""});
      };
      const auto acts = [mask = bit](const StationSample& s) {
        return (s.limits & mask) != 0 ? 2 : (s.limits & mask << kWarningShift) != 0 ? 1 : 0;
      };
      auto acting = stretches(*side, acts, make);
      if (acting.empty()) continue;
      any = true;
      lanes.lane(std::string(name) + ", " + side_name, std::move(acting));
    }
  }
  return any ? lanes.svg() : "";
}

DelayQuantiles delay_quantiles(const Session& session, bool forward) {
  DelayQuantiles out;
  for (const LinkSample& p : session.link) {
    if (p.forward != forward) continue;
    ++out.packets;
    out.lost += p.lost ? 1 : 0;
  }
  Delays d = delays_of(session, forward);
  for (auto [values, quantiles] :
       {std::pair(&d.asked_ms, &out.asked_ms), std::pair(&d.achieved_ms, &out.achieved_ms)}) {
    std::sort(values->begin(), values->end());
    for (const double share : kDelayShares) {
      if (values->empty()) break;
      const double rank = std::ceil(share * static_cast<double>(values->size())) - 1;
      quantiles->push_back((*values)[static_cast<std::size_t>(std::max(0.0, rank))]);
    }
  }
  return out;
}

}  // namespace farhand
