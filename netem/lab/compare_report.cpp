#include "netem/lab/compare_report.hpp"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <limits>
#include <sstream>

#include "common/config/json.hpp"
#include "common/judge/digits.hpp"
#include "common/judge/summary.hpp"
#include "common/show/format.hpp"
#include "common/show/plot.hpp"
#include "common/show/report.hpp"

namespace farhand {
namespace {

struct Column {
  const char *head, *unit;
  double factor;            // from SI to the unit
  std::string_view key;     // of the metric
  std::string_view second;  // of a second one behind it, if any
};

constexpr Column kColumns[] = {
    {"F_m/F_s", "1", 1.0, "force_ratio", ""},
    {"k felt", "%", 100.0, "k_seen_ratio", ""},
    {"residual", "mrad", 1e3, "residual_p2p_rad", ""},
    {"tracking", "mrad", 1e3, "tracking_rms_rad", ""},
    {"phantom", "N m", 1, "phantom_peak_nm", ""},
    {"drag", "mN m s/rad", 1e3, "drag_nms_per_rad", ""},
    {"F_m - F_s", "mN m", 1e3, "force_error_rms_nm", ""},
    {"of motion", "mN m", 1e3, "force_error_of_motion_rms_nm", ""},
    {"energy", "mJ", 1e3, "energy_min_both_j", ""},
    {"forward", "ms", 1.0, "delay_forward_median_ms", "delay_forward_p99_ms"},
    {"backward", "ms", 1.0, "delay_backward_median_ms", "delay_backward_p99_ms"},
    {"lost", "%", 100.0, "loss", ""},
};

const std::string& architecture_of(const ComparedSession& session) {
  return scene::Architecture_Name(session.loaded.scene.architecture());
}

const char* ran_in(const ComparedSession& session) { return session.in_lab ? "lab" : "processes"; }

// Whose reason is told where it has none.
const Metric& told(const ComparedSession& session, const Column& column) {
  const Metric& first = session.metrics.at(column.key);
  return column.second.empty() || !first.absent_because.empty() ? first : session.metrics.at(column.second);
}

std::string shown(const ComparedSession& session, const Column& column) {
  if (!told(session, column).absent_because.empty()) return "-";
  std::string out = three_digits(column.factor * session.metrics.number(column.key));
  if (!column.second.empty()) out += " / " + three_digits(column.factor * session.metrics.number(column.second));
  return out;
}

std::string stable(const ComparedSession& session) {
  return session.metrics.is_true("stable") ? "stable" : session.metrics.is_false("stable") ? "not stable" : "-";
}

std::string attribute_title(const std::string& text) { return text.empty() ? "" : " title=\"" + escaped(text) + "\""; }

// Names are long and the column is narrow: lines may end behind their parts.
std::string breakable(const std::string& name) {
  std::string out;
  for (const char c : escaped(name)) out += c == '_' || c == '-' ? std::string(1, c) + "<wbr/>" : std::string(1, c);
  return out;
}

std::string cell(const std::string& text, const std::string& title, const std::string& under = "") {
  return "<td" + attribute_title(title) + ">" + breakable(text) +
         (under.empty() ? "" : "<br/><span class=\"note\">" + breakable(under) + "</span>") + "</td>";
}

std::string joined(const std::vector<std::string>& all) {
  std::string out;
  for (const std::string& one : all) out += (out.empty() ? "" : "; ") + one;
  return out;
}

std::string sessions_table(const std::vector<ComparedSession>& sessions) {
  std::string out = "<table><tr><th>session</th><th>verdict</th>";
  for (const Column& column : kColumns) {
    std::string meaning;
    for (const std::string_view key : {column.key, column.second}) {
      for (const MetricInfo& info : kMetrics)
        if (info.key == key)
          meaning += (meaning.empty() ? "" : " / ") + std::string(key) + ": " + std::string(info.meaning);
    }
    out +=
        "<th class=\"n\"" + attribute_title(meaning) + ">" + escaped(column.head) + "<br/>(" + column.unit + ")</th>";
  }
  out += "</tr>\n";
  for (const ComparedSession& session : sessions) {
    const Metrics& metrics = session.metrics;
    out += "<tr>" +
           cell(session.name, "scene " + session.loaded.name + ", seed " + std::to_string(session.loaded.scene.seed()),
                architecture_of(session) + ", " + ran_in(session)) +
           "<td" + attribute_title(joined(metrics.list("reasons"))) + ">" + escaped(metrics.text("verdict")) +
           "<br/><span class=\"note\"" + attribute_title(metrics.at("stable").absent_because) + ">" + stable(session) +
           "</span></td>";
    for (const Column& column : kColumns)
      out += "<td class=\"n\"" + attribute_title(told(session, column).absent_because) + ">" + shown(session, column) +
             "</td>";
    out += "</tr>\n";
  }
  return out + "</table>\n";
}

std::string differences_table(const std::vector<ComparedSession>& sessions,
                              const std::vector<SteadyDifference>& differences) {
  std::string out =
      "<table><tr><th>scene</th><th>processes</th><th>lab</th><th class=\"n\">F_m/F_s, processes</th><th "
      "class=\"n\">F_m/F_s, lab</th><th class=\"n\">difference</th></tr>\n";
  for (const SteadyDifference& d : differences) {
    const ComparedSession &p = sessions[d.processes], &l = sessions[d.lab];
    out += "<tr>" + cell(p.loaded.name, "") + cell(p.name, "") + cell(l.name, "");
    for (const ComparedSession* side : {&p, &l})
      out += "<td class=\"n\">" + three_digits(side->metrics.number("force_ratio")) + "</td>";
    out += "<td class=\"n\"" + attribute_title(d.absent_because) + ">" + three_digits(d.force_ratio) + "</td></tr>\n";
  }
  return out + "</table>\n";
}

struct Span {
  double from = std::numeric_limits<double>::infinity(), until = -from;
  void hold(const std::vector<double>& values) {
    for (const double y : values)
      if (std::isfinite(y)) from = std::min(from, y), until = std::max(until, y);
  }
  bool is_one() const { return until > from; }
};

std::string pictures(const std::vector<ComparedSession>& sessions) {
  Span time, torque;
  for (const ComparedSession& session : sessions) {
    for (const SideCurves* side : {&session.curves.master, &session.curves.slave})
      time.hold(side->t_s), torque.hold(side->F_nm);
  }
  const double margin = 0.03 * (torque.until - torque.from);
  PlotAxis x{"time (s)"}, y{"torque (N m)"};
  if (time.is_one()) x.from = time.from, x.until = time.until;
  if (torque.is_one()) y.from = torque.from - margin, y.until = torque.until + margin;
  std::string out;
  for (const ComparedSession& session : sessions) {
    const AlignedSession& curves = session.curves;
    out += "<h3>" + escaped(session.name + ": " + architecture_of(session) + ", " + ran_in(session)) + "</h3>\n";
    Plot plot(curves.true_torque ? "Torque, true" : "Torque, estimated", x, y, 960, 214);
    Landmarks landmarks;
    const scene::Windows& w = session.loaded.scene.windows();
    if (w.has_free()) landmarks.windows.push_back({w.free().from_s(), w.free().until_s(), "free window"});
    if (w.has_contact()) landmarks.windows.push_back({w.contact().from_s(), w.contact().until_s(), "contact window"});
    plot.landmarks(landmarks);
    plot.line("therapist on device F_m", curves.master.t_s, curves.master.F_nm, Ink::kMaster, kGap_s);
    plot.line("device on hand F_s", curves.slave.t_s, curves.slave.F_nm, Ink::kSlave, kGap_s);
    out += plot.svg();
  }
  return out;
}

// Of a column in text.
int width_of(const Column& column) {
  const std::size_t least = column.second.empty() ? 9 : 15;
  return static_cast<int>(std::max({least, std::string(column.head).size() + 2, std::string(column.unit).size() + 2}));
}

std::string note(const std::string& words) { return "<p class=\"note\">" + escaped(words) + "</p>\n"; }

}  // namespace

std::string comparison_text(const std::vector<ComparedSession>& sessions) {
  std::ostringstream out;
  std::size_t width = 7;
  for (const ComparedSession& session : sessions) width = std::max(width, session.name.size());
  const int named = static_cast<int>(width) + 2;
  out << std::left << std::setw(named) << "session" << std::setw(11) << "ran in" << std::setw(10) << "verdict"
      << std::setw(12) << "contact" << std::right;
  for (const Column& column : kColumns) out << std::setw(width_of(column)) << column.head;
  out << '\n' << std::setw(named + 33) << "";
  for (const Column& column : kColumns) out << std::setw(width_of(column)) << column.unit;
  out << '\n';
  for (const ComparedSession& session : sessions) {
    out << std::left << std::setw(named) << session.name << std::setw(11) << ran_in(session) << std::setw(10)
        << session.metrics.text("verdict") << std::setw(12) << stable(session) << std::right;
    for (const Column& column : kColumns) out << std::setw(width_of(column)) << shown(session, column);
    out << '\n';
  }
  for (const SteadyDifference& d : steady_differences(sessions)) {
    out << sessions[d.processes].name << ": F_m/F_s of the processes less that of the lab (" << sessions[d.lab].name
        << "): " << three_digits(d.force_ratio) << (d.absent_because.empty() ? "" : ", " + d.absent_because) << '\n';
  }
  return out.str();
}

std::string comparison_html(const std::vector<ComparedSession>& sessions) {
  std::string out = "<h1>Sessions compared</h1>\n<p class=\"under\">" + std::to_string(sessions.size()) +
                    " sessions: real processes, and runs of the lab in virtual time</p>\n" + sessions_table(sessions);
  out += note(
      "F_m/F_s, k felt: steady contact, ideal 1 and 100 %. Residual: motion at the end of contact. Tracking, drag: "
      "free "
      "motion. F_m - F_s, of motion: RMS in contact, at the same instant and against what the therapist felt when he "
      "made the motion. Energy: least of both persons' sum; negative beyond what moving parts store, energy was made. "
      "Forward, return: one-way delay, median / 99 %. The head of a column and a dash tell more when pointed at.");
  out += "<h2>Processes against the lab</h2>\n";
  const std::vector<SteadyDifference> differences = steady_differences(sessions);
  out += differences.empty() ? note("No scene is here both from processes and from the lab.")
                             : differences_table(sessions, differences);
  out += "<h2>Torques</h2>\n" + note("All pictures have the same axes.") + pictures(sessions);
  return html_page("farhand: sessions compared",
                   out + "<footer>\n<p>" + escaped("farhand " FARHAND_VERSION ". " + library_versions() + ".") +
                       "</p>\n</footer>\n");
}

std::string comparison_json(const std::vector<ComparedSession>& sessions) {
  Json rows = Json::array(), pairs = Json::array();
  for (const ComparedSession& session : sessions) {
    rows.push_back(Json::object({{"name", session.name},
                                 {"architecture", architecture_of(session)},
                                 {"ran_in", ran_in(session)},
                                 {"metrics", Json::parse(summary_json(session.metrics, !session.in_lab))}}));
  }
  for (const SteadyDifference& d : steady_differences(sessions)) {
    pairs.push_back(Json::object({{"scene", sessions[d.processes].loaded.name},
                                  {"processes", sessions[d.processes].name},
                                  {"lab", sessions[d.lab].name},
                                  {"force_ratio_difference", d.force_ratio},
                                  {"absent_because", d.absent_because}}));
  }
  return Json::object({{"sessions", rows}, {"differences", pairs}}).dump(2) + "\n";
}

}  // namespace farhand
