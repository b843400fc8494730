#include "common/show/report.hpp"

#include <google/protobuf/stubs/common.h>

#include <Eigen/Core>
#include <asio/version.hpp>
#include <boost/version.hpp>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <stdexcept>

#include "common/advice/warnings.hpp"
#include "common/config/json.hpp"
#include "common/config/load.hpp"
#include "common/judge/digits.hpp"
#include "common/show/figures.hpp"
#include "common/show/format.hpp"

namespace farhand {
namespace {

constexpr std::size_t kMaxListed = 200;  // events in the table

constexpr std::string_view kStyle = R"(
body{font:14px/1.45 "Helvetica Neue",Arial,"Liberation Sans","DejaVu Sans",sans-serif;color:#1a1a1a;background:#fff;max-width:980px;margin:24px auto;padding:0 16px}
h1{font-size:24px;margin:0 0 2px}h2{font-size:18px;margin:34px 0 6px;padding-bottom:4px;border-bottom:1px solid #ccc}h3{font-size:14px;margin:18px 0 4px}
p{margin:6px 0;max-width:76ch}.under{color:#555;margin:0 0 14px}.note{color:#555;font-size:12.5px}
.verdict{border-left:8px solid;padding:10px 16px;margin:12px 0;background:#f6f6f6}.verdict b{font-size:19px}.verdict ul{margin:6px 0 0;padding-left:20px}
.ok{border-color:#2a7f4f}.degraded{border-color:#e6a100;border-left-style:double;border-left-width:12px}.failed{border-color:#111;background:#ececec}
.cards{display:grid;grid-template-columns:repeat(4,1fr);gap:10px;margin:14px 0}.card{border:1px solid #d5d5d5;border-radius:4px;padding:8px 12px}
.card .what{font-size:12px;color:#444}.card .value{font-size:22px;line-height:1.3;font-weight:600;white-space:nowrap}.card .value small{font-size:13px;font-weight:400}.card .limit{font-size:11.5px;color:#555}
.out{border-width:2px;border-color:#111}
svg{display:block;max-width:100%;height:auto;margin:10px 0 2px;font:11px "Helvetica Neue",Arial,"Liberation Sans","DejaVu Sans",sans-serif;fill:#333}
svg .title{font-size:13px;font-weight:600;fill:#111}svg .label{font-size:11.5px}svg .grid{stroke:#e3e3e3;stroke-width:.7}svg .frame{fill:none;stroke:#777;stroke-width:.9}svg .axis{stroke:#777}
svg .window{fill:#f1f1ec}svg .windowname{fill:#77776a;font-style:italic;font-size:10.5px}svg .event{stroke:#777;stroke-width:.8;stroke-dasharray:3 3}svg .eventname{font-size:10px;fill:#555}
svg .rule{stroke:#111;stroke-width:1;stroke-dasharray:9 4}svg .rulename{fill:#111}svg .lanename{fill:#111}svg .mark{fill:none;stroke:#111;stroke-width:1.6}
.pair{display:flex;gap:10px}.pair svg{flex:1 1 0;min-width:0}
table{border-collapse:collapse;margin:8px 0;font-size:12.5px}th,td{text-align:left;vertical-align:top;padding:3px 12px 3px 0;border-bottom:1px solid #e3e3e3}th{border-bottom:1px solid #777}
td.n,th.n{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}code,pre{font:11.5px/1.4 "DejaVu Sans Mono",Menlo,Consolas,monospace}pre{background:#f6f6f6;padding:10px 12px;white-space:pre-wrap;overflow-wrap:anywhere}
footer{margin-top:36px;border-top:2px solid #777;padding-top:8px;font-size:12.5px}
@media (max-width:700px){.cards{grid-template-columns:repeat(2,1fr)}.pair{display:block}}
@media print{@page{margin:14mm}body{margin:0;max-width:none;font-size:11pt}svg,table,.card,.verdict{break-inside:avoid}h2,h3{break-after:avoid}table.long{break-inside:auto}.verdict,svg,.card,pre{-webkit-print-color-adjust:exact;print-color-adjust:exact}}
)";

std::string paragraph(const std::string& words) { return "<p>" + escaped(words) + "</p>\n"; }
std::string note(const std::string& words) { return "<p class=\"note\">" + escaped(words) + "</p>\n"; }

std::string percent(double share) { return three_digits(100 * share) + " %"; }

std::string verdict_box(const Metrics& metrics) {
  const std::string verdict = metrics.text("verdict");
  const std::string words = verdict == "ok"         ? "\u2713 Session ok"
                            : verdict == "degraded" ? "\u25b2 Session degraded"
                                                    : "\u2715 Session failed";
  std::string out = "<div class=\"verdict " + escaped(verdict) + "\"><b>" + words + "</b>\n";
  const auto& reasons = metrics.list("reasons");
  if (reasons.empty()) out += paragraph("Nothing failed and every judged number is within its limit.");
  if (!reasons.empty()) {
    out += "<ul>\n";
    for (const std::string& reason : reasons) out += "<li>" + escaped(reason) + "</li>\n";
    out += "</ul>\n";
  }
  const double engaged_s = metrics.number("engaged_s"), ratio = metrics.number("force_ratio");
  std::string sentence = "Both sides were engaged for " + three_digits(engaged_s) + " s.";
  if (std::isfinite(ratio))
    sentence += " In steady contact the therapist felt " + three_digits(ratio) + " times the torque on the hand.";
  return out + paragraph(sentence) + "</div>\n";
}

// What the loader said about the scene before anything moved.
std::string said_at_load(const Session& session) {
  std::vector<std::string> said;
  try {
    said = warnings(load_scene_text(session.scene_text, "scene").scene);
  } catch (const ConfigError&) {
    return "";  // a scene of another version
  }
  if (said.empty()) return "";
  std::string out = "<div class=\"note\">Said at load:<ul>\n";
  for (const std::string& warning : said) out += "<li>" + escaped(warning) + "</li>\n";
  return out + "</ul></div>\n";
}

// One of the numbers that matter. `value` and `unit` are already words; limit says what would be right.
std::string card(const std::string& what, const std::string& value, const std::string& unit, const std::string& limit,
                 bool exceeded = false) {
  return "<div class=\"card" + std::string(exceeded ? " out" : "") + "\"><div class=\"what\">" + escaped(what) +
         "</div><div class=\"value\">" + escaped(value) + " <small>" + escaped(unit) +
         "</small></div><div class=\"limit\">" + escaped(limit) + "</div></div>\n";
}

std::string cards(const Metrics& metrics, const scene::Scene& scene) {
  const scene::Windows& w = scene.windows();
  std::string out = "<div class=\"cards\">\n";
  const auto number = [&](const std::string& what, std::string_view key, double factor, const std::string& unit,
                          const std::string& limit, bool exceeded = false) {
    const double y = metrics.number(key);
    out += std::isfinite(y) ? card(what, three_digits(factor * y), unit, limit, exceeded)
                            : card(what, "-", "", metrics.at(key).absent_because);
  };
  const double tracking = metrics.number("tracking_rms_rad");
  const std::string degrees =
      std::isfinite(tracking) ? " = " + three_digits(tracking * 180 / std::numbers::pi) + "\u00b0" : "";
  number("Tracking, free motion (RMS)", "tracking_rms_rad", 1e3, "mrad" + degrees,
         w.has_degraded_tracking_rad() ? "limit " + three_digits(1e3 * w.degraded_tracking_rad()) + " mrad"
                                       : "no limit set",
         w.has_degraded_tracking_rad() && tracking > w.degraded_tracking_rad());
  number("Phantom force, whole run", "phantom_peak_nm", 1, "N m", "ideal 0: nothing touches the hand");
  const double threshold = metrics.number("friction_threshold_nm"), F_c = metrics.number("friction_measured_nm");
  if (std::isfinite(threshold)) {
    const std::string spread = three_digits(metrics.number("friction_spread_nm"));
    const std::string of = std::isfinite(F_c) ? "F_c " + three_digits(F_c) + " N m, spread " + spread + " N m; " : "";
    out += card("Friction taken for the device", three_digits(threshold), "N m", of + metrics.text("friction_source"));
  }
  number("Drag, free motion", "drag_nms_per_rad", 1e3, "mN m s/rad", "ideal 0");
  number("Torque ratio F_m/F_s, contact", "force_ratio", 1, "", "ideal 1");
  number("Stiffness felt, contact", "k_seen_ratio", 100, "% of the hand's", "ideal 100 %");
  number("Force error, contact (RMS)", "force_error_rms_nm", 1e3, "mN m", "F_m - F_s, same instant; ideal 0");
  const double residual = metrics.number("residual_p2p_rad");
  const bool unstable = metrics.is_false("stable");
  out += card("Contact",
              unstable                    ? "not stable"
              : metrics.is_true("stable") ? "stable"
                                          : "-",
              "",
              std::isfinite(residual)
                  ? "moves by " + three_digits(1e3 * residual) + " mrad at the end; limit 5 mrad, or half of before"
                  : metrics.at("residual_p2p_rad").absent_because,
              unstable);
  const double forward = metrics.number("delay_forward_median_ms"),
               backward = metrics.number("delay_backward_median_ms");
  if (std::isfinite(forward) && std::isfinite(backward)) {
    out += card("Delay, forward / return", three_digits(forward) + " / " + three_digits(backward), "ms",
                "99 %: " + three_digits(metrics.number("delay_forward_p99_ms")) + " / " +
                    three_digits(metrics.number("delay_backward_p99_ms")) + " ms");
  } else {
    number("Round trip (median)", "rtt_median_ms", 1, "ms", "one-way delays were not recorded");
  }
  const double loss = metrics.number("loss"), late = metrics.number("late");
  out += card("Lost / late packets", three_digits(100 * loss) + " / " + three_digits(100 * late), "%",
              w.has_degraded_late() ? "limit of late packets " + percent(w.degraded_late()) : "no limit set",
              w.has_degraded_late() && late > w.degraded_late());
  return out + "</div>\n";
}

std::string quantile_table(const Session& session) {
  std::string rows;
  for (const bool forward : {true, false}) {
    const DelayQuantiles q = delay_quantiles(session, forward);
    const std::string loss =
        q.packets > 0 ? percent(static_cast<double>(q.lost) / static_cast<double>(q.packets)) : "-";
    for (const bool asked : {true, false}) {
      const auto& values = asked ? q.asked_ms : q.achieved_ms;
      if (values.empty()) continue;
      rows += forward ? "<tr><td>master to slave</td>" : "<tr><td>slave to master</td>";
      rows += asked ? "<td>asked</td>" : "<td>achieved</td>";
      for (const double value : values) rows += "<td class=\"n\">" + three_digits(value) + "</td>";
      rows += "<td class=\"n\">" + std::to_string(q.packets) + "</td><td class=\"n\">" + loss + "</td></tr>\n";
    }
  }
  if (rows.empty()) return "";
  return "<table><tr><th>way</th><th>delay (ms)</th><th class=\"n\">least</th><th class=\"n\">5 %</th><th "
         "class=\"n\">median</th><th class=\"n\">95 %</th><th "
         "class=\"n\">99 %</th><th class=\"n\">greatest</th><th class=\"n\">packets</th><th "
         "class=\"n\">lost</th></tr>\n" +
         rows + "</table>\n";
}

std::string shown(const Metric& metric) {
  return std::visit(
      [&](const auto& v) -> std::string {
        using T = std::decay_t<decltype(v)>;
        if constexpr (std::is_same_v<T, std::monostate>)
          return "- (" + metric.absent_because + ")";
        else if constexpr (std::is_same_v<T, bool>)
          return v ? "yes" : "no";
        else if constexpr (std::is_same_v<T, std::uint64_t>)
          return std::to_string(v);
        else if constexpr (std::is_same_v<T, double>)
          return quantity(v, metric.info->unit);
        else if constexpr (std::is_same_v<T, std::string>)
          return v;
        else
          return "";
      },
      metric.value);
}

std::string metrics_table(const Metrics& metrics) {
  std::string out = "<table class=\"long\"><tr><th>metric</th><th class=\"n\">value</th><th>meaning</th></tr>\n";
  for (const Metric& metric : metrics.all()) {
    if (metric.info->key == "reasons" || metric.info->key == "absent") continue;  // said above, or in the row itself
    const bool absent = std::holds_alternative<std::monostate>(metric.value);
    out += "<tr><td><code>" + escaped(metric.info->key) + "</code></td><td class=\"n\">" +
           (absent ? "-" : escaped(shown(metric))) + "</td><td>" + escaped(metric.info->meaning) +
           (absent ? " <i>(" + escaped(metric.absent_because) + ")</i>" : "") + "</td></tr>\n";
  }
  return out + "</table>\n";
}

std::string counters_table(const Session& session) {
  constexpr std::pair<const char*, std::uint64_t StationCounters::*> kRows[] = {
      {"ticks", &StationCounters::ticks},
      {"ticks longer than a period", &StationCounters::overruns},
      {"ticks skipped", &StationCounters::missed_ticks},
      {"packets sent", &StationCounters::sent},
      {"packets received", &StationCounters::received},
      {"lost on the way", &StationCounters::lost},
      {"late for play-out", &StationCounters::late},
      {"overtaken", &StationCounters::reordered},
      {"duplicate", &StationCounters::duplicate},
      {"rejected: checksum", &StationCounters::rejected_checksum},
      {"rejected: format", &StationCounters::rejected_format},
      {"rejected: session", &StationCounters::rejected_session},
      {"rejected: expired", &StationCounters::rejected_expired},
      {"rejected: not finite", &StationCounters::rejected_not_finite},
      {"rejected: sender without a session", &StationCounters::rejected_foreign},
      {"dropped: too long", &StationCounters::dropped_too_long},
      {"dropped by the system: too long, or no room", &StationCounters::dropped_by_kernel},
      {"dropped: handshakes beyond their share", &StationCounters::dropped_handshake},
      {"not sent: refused by the system", &StationCounters::send_failed},
      {"ticks in which the peer's wish was cut", &StationCounters::cut_ticks},
      {"serial frames sent", &StationCounters::serial_sent},
      {"serial frames received", &StationCounters::serial_received},
      {"serial CRC errors", &StationCounters::serial_crc_errors},
      {"serial line: command and echo, least (us)", &StationCounters::serial_need_us},
      {"serial line: command and echo, most (us)", &StationCounters::serial_most_us},
      {"serial echoes 10 ms late", &StationCounters::serial_warned},
      {"torque let go by the MCU", &StationCounters::serial_sagged},
  };
  std::string out =
      "<table><tr><th>counted by the stations</th><th class=\"n\">master</th><th class=\"n\">slave</th></tr>\n";
  for (const auto& [name, counter] : kRows) {
    out += std::string("<tr><td>") + name + "</td><td class=\"n\">" + std::to_string(session.master_counters.*counter) +
           "</td><td class=\"n\">" + std::to_string(session.slave_counters.*counter) + "</td></tr>\n";
  }
  return out + "</table>\n";
}

std::string events_table(const std::vector<SessionEvent>& events) {
  if (events.empty()) return note("No event was recorded.");
  std::string out =
      "<table class=\"long\"><tr><th class=\"n\">no.</th><th class=\"n\">time (s)</th><th>side</th><th>what "
      "happened</th></tr>\n";
  for (std::size_t k = 0; k < std::min(events.size(), kMaxListed); ++k) {
    out += "<tr><td class=\"n\">" + std::to_string(k + 1) + "</td><td class=\"n\">" + tick_label(events[k].t_s, 0.001) +
           "</td><td>" + escaped(events[k].who) + "</td><td>" + escaped(events[k].text) + "</td></tr>\n";
  }
  out += "</table>\n";
  if (events.size() > kMaxListed)
    out += note(std::to_string(events.size() - kMaxListed) + " more events are in the recording.");
  return out;
}

std::string footer(const Session& session) {
  const std::string seed = std::to_string(session.seed);
  std::string out = "<footer>\n" + paragraph("farhand " FARHAND_VERSION ", scene " + session.scene_name + ", seed " +
                                             seed + ". " + library_versions() + ".");
  out += paragraph(std::string("To reproduce: save the scene below as scene.txtpb and run") +
                   (session.deterministic ? ":" : " it in virtual time:"));
  out += "<pre>farhand-lab run ./scene.txtpb --seed " + seed + " --report report.html</pre>\n";
  if (session.deterministic)
    out += note("This run was in virtual time: the same program gives the same numbers, digit for digit.");
  else
    out += note(
        "This run was against the clock of real machines: the run in virtual time has the same laws, world and link "
        "model, but not the same packets.");
  return out + "<h3>Scene, with every default filled in</h3>\n<pre>" + escaped(session.scene_text) +
         "</pre>\n</footer>\n";
}

// Pictures that may have nothing to show say so in words.
std::string or_note(const std::string& picture, const std::string& otherwise) {
  return picture.empty() ? note(otherwise) : picture;
}

}  // namespace

std::string library_versions() {
  const auto dotted = [](int v, int a, int b) {
    return std::to_string(v / a) + "." + std::to_string(v / b % (a / b)) + "." + std::to_string(v % b);
  };
  return "Eigen " + std::to_string(EIGEN_WORLD_VERSION) + "." + std::to_string(EIGEN_MAJOR_VERSION) + "." +
         std::to_string(EIGEN_MINOR_VERSION) + ", Protobuf " + dotted(GOOGLE_PROTOBUF_VERSION, 1000000, 1000) +
         ", Asio " + dotted(ASIO_VERSION, 100000, 100) + ", Boost " + dotted(BOOST_VERSION, 100000, 100) +
         ", nlohmann-json " + json_library_version() + ", compiled by g++ or compatible " + __VERSION__;
}

std::string html_page(const std::string& title, const std::string& body) {
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n<meta name=\"viewport\" "
         "content=\"width=device-width\"/>\n<title>" +
         escaped(title) + "</title>\n<style>" + std::string(kStyle) + "</style>\n</head>\n<body>\n" + body +
         "</body>\n</html>\n";
}

std::string report_html(const Session& session, const scene::Scene& scene, const Metrics& metrics) {
  const Figures figures(session, scene);
  const std::string name = session.scene_name.empty() ? "unnamed scene" : session.scene_name;
  std::string out = "<h1>Session " + escaped(name) + "</h1>\n<p class=\"under\">" + escaped(scene.description()) +
                    (scene.description().empty() ? "" : " \u00b7 ") + "seed " + std::to_string(session.seed) +
                    " \u00b7 " + (session.deterministic ? "virtual time" : "real time") + "</p>\n";
  out += verdict_box(metrics) + said_at_load(session) + cards(metrics, scene);
  out += figures.positions() + figures.torques() + figures.states();
  out += note(
      "Numbers above the pictures are the events of the list below. Shaded: the windows over which the numbers are "
      "computed.");

  out +=
      "<h2>Network</h2>\n" + or_note(figures.delays(true), "No packet from master to slave was recorded by the link.");
  out += or_note(figures.delays(false), "No packet from slave to master was recorded by the link.");
  if (!session.link.empty())
    out += figures.losses() + "<div class=\"pair\">" + figures.delay_histogram() + figures.delay_distribution() +
           "</div>\n" + quantile_table(session);
  out += note("The clocks of the two sides agree within \u00b1" + quantity(1e3 * session.clock_offset_bound_s, "ms") +
              ".");

  out += "<h2>Receiver</h2>\n" + figures.round_trip_and_playout();
  out += note(
      "Depth: how long a packet waits over the fastest one, so that late ones still find their turn. Late for their "
      "turn: " +
      three_digits(100 * metrics.number("late")) + " % of the packets received.");

  out +=
      "<h2>Laws</h2>\n" + or_note(figures.compensation(), "No communication disturbance was compensated in this run.");
  out += or_note(figures.alpha(), "The compensation was not scaled (alpha = 1 throughout).");
  out += figures.law_signals();

  out += "<h2>Motion</h2>\n" + figures.tracking_error();
  out += note(
      "T_p is the delay in force: that of the fastest packet so far plus the depth of the buffer. Only ticks with both "
      "sides engaged count.");

  out += "<h2>Torque</h2>\n" + or_note(figures.estimated_torques(),
                                       "The true torques are not known outside a simulated world; all torques here are "
                                       "the estimates of the stations.");
  out += figures.force_error() + figures.torque_against_angle();
  out += note(
      "In ideal teleoperation the two loops lie on each other. A loop that leans less on the therapist's side is a "
      "hand that feels softer than it is.");

  out += "<h2>Limits</h2>\n" + or_note(figures.limits(), "No limit acted during this run.");
  out += "<h2>Events</h2>\n" + events_table(figures.events());
  out += "<h2>All metrics</h2>\n" + metrics_table(metrics);
  out += "<h2>Counters</h2>\n" + counters_table(session);
  return html_page("farhand: " + name, out + footer(session));
}

}  // namespace farhand
