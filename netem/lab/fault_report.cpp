#include "netem/lab/fault_report.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "common/config/schema.hpp"
#include "netem/lab/html_table.hpp"

namespace farhand::faults {
namespace {

std::string rounded(double value, int digits) {
  if (std::isnan(value)) return "-";
  char text[32];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

std::string side(StationState state, Reason reason) {
  return std::string(farhand::name_of(state)) + ": " + farhand::name_of(reason);
}

// A leading tab marks a column of numbers.
std::vector<std::string> cells(const Result& r) {
  return {r.of->fault + (r.of->direct ? " (direct drive)" : ""),
          name_of(r.of->at),
          side(r.slave, r.slave_reason),
          side(r.master, r.master_reason),
          "\t" + rounded(r.slave_ms, 0),
          "\t" + rounded(r.master_ms, 0),
          "\t" + rounded(r.let_go_ms, 0),
          "\t" + rounded(r.torque_nm, 2),
          "\t" + rounded(r.velocity_rad_s, 2),
          "\t" + rounded(1e3 * r.jump_rad, 2),
          name_of(r.of->expected.remedy)};
}

const std::vector<std::string> kColumns{
    "fault",         "in state",      "patient's side then", "therapist's side then", "\treacts, ms",   "\tmaster, ms",
    "\tlets go, ms", "\ttorque, N m", "\tvelocity, rad/s",   "\tjump, mrad",          "back to work by"};

std::size_t wrong(const std::vector<Result>& results) {
  return static_cast<std::size_t>(std::ranges::count_if(results, [](const Result& r) { return !r.complaint.empty(); }));
}

std::string summary(const std::vector<Result>& results) {
  double torque = 0, velocity = 0, jump = 0;
  for (const Result& r : results) {
    torque = std::max(torque, r.torque_nm);
    velocity = std::max(velocity, r.velocity_rad_s);
    jump = std::max(jump, r.jump_rad);
  }
  return std::to_string(results.size()) + " rows, " + std::to_string(wrong(results)) +
         " otherwise than expected; the most anywhere: " + rounded(torque, 2) + " N m (limit " +
         rounded(kTorqueLimit, 2) + "), " + rounded(velocity, 2) + " rad/s, a jump of " + rounded(1e3 * jump, 2) +
         " mrad (limit " + rounded(1e3 * kJumpLimit, 2) + ")";
}

std::string quoted(const std::string& text) {  // names and sentences of ours: no control characters
  std::string out = "\"";
  for (const char c : text) out += c == '"' || c == '\\' ? std::string("\\") + c : std::string(1, c);
  return out + "\"";
}

std::string number(double value) { return std::isfinite(value) ? shortest(value) : "null"; }

}  // namespace

std::string text_of(const std::vector<Result>& results) {
  std::vector<std::vector<std::string>> lines{kColumns};
  for (const Result& r : results) lines.push_back(cells(r));
  std::vector<std::size_t> width(kColumns.size());
  for (const auto& line : lines) {
    for (std::size_t k = 0; k < line.size(); ++k) width[k] = std::max(width[k], line[k].size());
  }
  std::string out;
  for (std::size_t n = 0; n < lines.size(); ++n) {
    for (std::size_t k = 0; k < width.size(); ++k) {
      const bool right = lines[n][k].starts_with('\t');
      const std::string cell = right ? lines[n][k].substr(1) : lines[n][k];
      const std::string gap(width[k] - cell.size() + 2, ' ');
      out += right ? gap + cell + "  " : cell + (k + 1 < width.size() ? gap : "");
    }
    out += '\n';
    if (n > 0 && !results[n - 1].complaint.empty()) out += "    OTHERWISE: " + results[n - 1].complaint + '\n';
  }
  return out + "  " + summary(results) + '\n';
}

std::string json_of(const std::vector<Result>& results) {
  std::string out = "[";
  for (const Result& r : results) {
    out += out.size() > 1 ? ",\n " : "\n ";
    out += "{\"fault\": " + quoted(r.of->fault) +
           ", \"device\": " + quoted(r.of->direct ? "direct drive" : "series elastic") +
           ", \"in_state\": " + quoted(name_of(r.of->at)) + ", \"slave\": " + quoted(farhand::name_of(r.slave)) +
           ", \"slave_reason\": " + quoted(farhand::name_of(r.slave_reason)) +
           ", \"master\": " + quoted(farhand::name_of(r.master)) +
           ", \"master_reason\": " + quoted(farhand::name_of(r.master_reason)) +
           ", \"reacts_ms\": " + number(r.slave_ms) + ", \"within_ms\": " + number(r.of->expected.within_ms) +
           ", \"master_ms\": " + number(r.master_ms) + ", \"lets_go_ms\": " + number(r.let_go_ms) +
           ", \"torque_nm\": " + number(r.torque_nm) + ", \"velocity_rad_s\": " + number(r.velocity_rad_s) +
           ", \"jump_rad\": " + number(r.jump_rad) + ", \"remedy\": " + quoted(name_of(r.of->expected.remedy)) +
           ", \"as_expected\": " + (r.complaint.empty() ? "true" : "false") +
           (r.complaint.empty() ? "" : ", \"complaint\": " + quoted(r.complaint)) + "}";
  }
  return out + "\n]\n";
}

std::string html_of(const std::vector<Result>& results) {
  std::string out =
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>farhand: fault matrix</title><style>" +
      std::string(kTableStyle) + "</style></head><body>\n<h1>Fault matrix</h1>\n";
  out += "<div class=\"verdict " + std::string(wrong(results) == 0 ? "ok" : "failed") + "\"><b>" +
         (wrong(results) == 0 ? "\u2713 Every fault ends as expected" : "\u2715 Not every fault ends as expected") +
         "</b><p>" + escaped(summary(results)) + "</p></div>\n";
  out +=
      "<p>Everything in virtual time, over 30 ms each way. Reacts: from the fault until the patient's side left the "
      "state that it was in; packets that were under way count. Lets go: until nothing is commanded to the hand. "
      "Torque, velocity: the most at the simulated hand from then on, through the operator's engaging again. Jump: the "
      "largest step of the motion to follow at a change of state, while aligning or while holding.</p>\n<table>\n" +
      row(kColumns, "th");
  for (const Result& r : results) {
    std::vector<std::string> line = cells(r);
    if (!r.complaint.empty()) line[0] += ": " + r.complaint;
    out += row(line, "td", r.complaint.empty() ? "" : " class=\"wrong\"");
  }
  out += "</table>\n<h2>With real programs and files</h2>\n<table>\n" +
         row({"fault", "in state", "what happens", "test"}, "th");
  for (const Elsewhere& e : elsewhere()) out += row({e.fault, e.state, e.outcome, e.test});
  return out + "</table>\n<footer>farhand " + FARHAND_VERSION +
         ". To reproduce: <code>farhand-lab faults --report FILE</code>.</footer>\n</body></html>\n";
}

}  // namespace farhand::faults
