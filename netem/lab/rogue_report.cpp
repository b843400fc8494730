#include "netem/lab/rogue_report.hpp"

#include <algorithm>
#include <cstdio>
#include <set>

#include "common/config/schema.hpp"
#include "netem/lab/html_table.hpp"

namespace farhand::rogue {
namespace {

std::string rounded(double value, int digits) {
  char text[48];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

// A leading tab marks a column of numbers.
std::vector<std::string> head() {
  std::vector<std::string> cells{"cell", "\tsessions", "\tengaged", "\tcrossed"};
  for (std::size_t k = 0; k < kLines; ++k) {
    const Line line = static_cast<Line>(k);
    cells.push_back(std::string("\t") + name_of(line) + ", " + (k < kBoundLines ? "of its bound" : unit_of(line)));
  }
  return cells;
}

std::vector<std::string> cells_of(const CellResult& r) {
  std::vector<std::string> cells{name_of(r.cell), "\t" + std::to_string(r.sessions), "\t" + std::to_string(r.engaged),
                                 "\t" + std::to_string(r.crossed)};
  for (const Found& found : r.found) cells.push_back("\t" + rounded(found.worst.ratio, 2));
  return cells;
}

// The worst of several cells, of each line.
std::array<const CellResult*, kLines> worst_of(const std::vector<CellResult>& results, Against against) {
  std::array<const CellResult*, kLines> worst{};
  for (const CellResult& r : results) {
    if (r.cell.against != against) continue;
    for (std::size_t k = 0; k < kLines; ++k) {
      if (worst[k] == nullptr || r.found[k].worst.ratio > worst[k]->found[k].worst.ratio) worst[k] = &r;
    }
  }
  return worst;
}

struct Sum {
  int sessions = 0, engaged = 0, crossed = 0;
  double virtual_s = 0;
};
Sum sum_of(const std::vector<CellResult>& results) {
  Sum sum;
  for (const CellResult& r : results) {
    sum.sessions += r.sessions;
    sum.engaged += r.engaged;
    sum.crossed += r.crossed;
    sum.virtual_s += r.virtual_s;
  }
  return sum;
}

std::string summary(const std::vector<CellResult>& results) {
  const Sum sum = sum_of(results);
  return std::to_string(sum.sessions) + " sessions in " + std::to_string(results.size()) + " cells, " +
         rounded(sum.virtual_s / 3600, 1) + " h of virtual time, " + std::to_string(sum.engaged) +
         " engaged for 0.5 s or more, " + std::to_string(sum.crossed) + " across a line";
}

std::string worst_text(const std::vector<CellResult>& results, Against against) {
  std::string out;
  const auto worst = worst_of(results, against);
  for (std::size_t k = 0; k < kLines; ++k) {
    if (worst[k] == nullptr || worst[k]->found[k].session < 0) continue;
    const Found& found = worst[k]->found[k];
    char text[256];
    std::snprintf(text, sizeof text, "    %-24s %12.4g %-6s", name_of(static_cast<Line>(k)), found.worst.value,
                  unit_of(static_cast<Line>(k)));
    out += text;
    if (k < kBoundLines) {
      std::snprintf(text, sizeof text, "bound %9.4g  ratio %8.3f", found.worst.bound, found.worst.ratio);
      out += text;
    } else {
      out += std::string(32, ' ');
    }
    std::snprintf(text, sizeof text, "  at %.3f s, %s, session %d\n", found.worst.t_s, name_of(worst[k]->cell).c_str(),
                  found.session);
    out += text;
  }
  return out;
}

}  // namespace

std::string text_of(const Outcome& outcome) {
  std::string out = "engaged for " + rounded(outcome.engaged_s, 3) + " s of " + rounded(outcome.lasted_s, 3) + " s\n";
  for (std::size_t k = 0; k < kLines; ++k) {
    const Worst& w = outcome.findings[k];
    char text[160];
    std::snprintf(text, sizeof text, "  %-24s %12.5g %-6s", name_of(static_cast<Line>(k)), w.value,
                  unit_of(static_cast<Line>(k)));
    out += text;
    if (k < kBoundLines) {
      std::snprintf(text, sizeof text, "bound %9.4g  ratio %8.4f%s", w.bound, w.ratio, w.ratio > 1 ? "  CROSSED" : "");
      out += text;
    }
    std::snprintf(text, sizeof text, "  at %.4f s\n", w.t_s);
    out += text;
  }
  return out;
}

std::string text_of(const std::vector<CellResult>& results) {
  std::string out;
  for (const CellResult& r : results) {
    char text[200];
    std::snprintf(text, sizeof text, "  %-44s %6d sessions %6d engaged %6d across a line %4d restarts",
                  name_of(r.cell).c_str(), r.sessions, r.engaged, r.crossed, r.restarts);
    out += text;
    const auto any = [&](Line line) { return r.found[static_cast<std::size_t>(line)].worst.value; };
    std::snprintf(text, sizeof text, "  %6.2f rad/s %6.2f W %6.3f rad %6.2f N m", any(Line::kAnySpeed),
                  any(Line::kAnyPower), any(Line::kAnyAngle), any(Line::kAnyTorque));
    out += std::string(text) + '\n';
    for (std::size_t k = 0; k < kBoundLines; ++k) {
      const Worst& w = r.found[k].worst;
      if (w.ratio <= 1) continue;
      std::snprintf(text, sizeof text, "      %-24s %10.4g %-5s bound %8.4g  ratio %7.3f\n",
                    name_of(static_cast<Line>(k)), w.value, unit_of(static_cast<Line>(k)), w.bound, w.ratio);
      out += text;
    }
  }
  for (const Against against : {Against::kPatient, Against::kTherapist}) {
    const std::string worst = worst_text(results, against);
    if (worst.empty()) continue;
    out += against == Against::kPatient ? "  The worst at the patient's hand:\n" : "  The worst at the therapist:\n";
    out += worst;
  }
  return out + "  " + summary(results) + '\n';
}

std::string rows_of(const std::vector<CellResult>& results, double ratio) {
  std::string out;
  std::set<std::string> seen;
  for (const CellResult& r : results) {
    for (std::size_t k = 0; k < kBoundLines; ++k) {
      if (r.found[k].session < 0 || r.found[k].worst.ratio <= ratio) continue;
      const std::string row = text_of(Row{r.cell, r.found[k].genome});
      if (seen.insert(row).second) out += row + '\n';
    }
  }
  return out;
}

std::string json_of(const std::vector<CellResult>& results, const Budget& budget) {
  std::string out = "{\"seed\": " + std::to_string(budget.seed) +
                    ", \"sessions_per_cell\": " + std::to_string(budget.sessions) + ", \"cells\": [";
  bool first = true;
  for (const CellResult& r : results) {
    out += first ? "\n " : ",\n ";
    first = false;
    out += "{\"cell\": \"" + name_of(r.cell) + "\", \"sessions\": " + std::to_string(r.sessions) +
           ", \"engaged\": " + std::to_string(r.engaged) + ", \"crossed\": " + std::to_string(r.crossed) +
           ", \"restarts\": " + std::to_string(r.restarts) + ", \"lines\": [";
    for (std::size_t k = 0; k < kLines; ++k) {
      const Found& f = r.found[k];
      out += std::string(k > 0 ? "," : "") + "\n  {\"line\": \"" + name_of(static_cast<Line>(k)) + "\", \"unit\": \"" +
             unit_of(static_cast<Line>(k)) + "\", \"value\": " + shortest(f.worst.value) +
             ", \"bound\": " + (k < kBoundLines ? shortest(f.worst.bound) : "null") +
             ", \"at_s\": " + shortest(f.worst.t_s) + ", \"session\": " + std::to_string(f.session) +
             ", \"replay\": \"" + text_of(Row{r.cell, f.genome}) + "\"}";
    }
    out += "]}";
  }
  return out + "\n]}\n";
}

std::string html_of(const std::vector<CellResult>& results, const Budget& budget) {
  const bool fine = std::ranges::all_of(results, &CellResult::fine);
  std::string out =
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>farhand: rogue peers</title><style>" +
      std::string(kTableStyle) + "</style></head><body>\n<h1>Rogue peers</h1>\n";
  out += "<div class=\"verdict " + std::string(fine ? "ok" : "failed") + "\"><b>" +
         (fine ? "\u2713 No line was crossed" : "\u2715 Lines were crossed") + "</b><p>" + escaped(summary(results)) +
         "</p></div>\n<p>An evolution strategy over what a peer with the right key may say, " +
         std::to_string(budget.sessions) + " sessions of 3 s or more in each cell, seed " +
         std::to_string(budget.seed) +
         ". Everything is measured at the simulated person. Columns up to the jump and the torque held pressed: the "
         "largest share of the bound that was reached.</p>\n<table>\n" +
         row(head(), "th");
  for (const CellResult& r : results) out += row(cells_of(r), "td", r.fine() ? "" : " class=\"wrong\"");
  return out + "</table>\n<footer>farhand " + FARHAND_VERSION +
         ". To reproduce: <code>farhand-lab rogue --report FILE</code>.</footer>\n</body></html>\n";
}

}  // namespace farhand::rogue
