#include "netem/lab/extreme_report.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "common/config/json.hpp"
#include "common/config/schema.hpp"
#include "common/judge/digits.hpp"
#include "common/show/format.hpp"
#include "netem/lab/html_table.hpp"

namespace farhand::extreme {
namespace {

std::string expectation(const Expected& expected) {
  switch (expected.verdict) {
    case Verdict::kAccurate:
      return "accurate to " + shortest(expected.within);
    case Verdict::kBounded:
      return "bounded by " + shortest(expected.within);
    case Verdict::kRefused:
      break;
  }
  return "refused: " + expected.reason;
}

struct Tally {
  std::size_t all = 0, wrong = 0;
  std::size_t of[3] = {};
};

// Families in the order of the catalogue.
std::vector<std::pair<std::string, Tally>> by_family(const std::vector<Result>& results) {
  std::vector<std::pair<std::string, Tally>> families;
  for (const Result& r : results) {
    if (families.empty() || families.back().first != r.of->family) families.emplace_back(r.of->family, Tally{});
    Tally& tally = families.back().second;
    ++tally.all;
    ++tally.of[static_cast<int>(r.of->expected.verdict)];
    tally.wrong += !r.complaint.empty();
  }
  return families;
}

Tally total(const std::vector<Result>& results) {
  Tally sum;
  for (const auto& [name, tally] : by_family(results)) {
    sum.all += tally.all;
    sum.wrong += tally.wrong;
    for (int v = 0; v < 3; ++v) sum.of[v] += tally.of[v];
  }
  return sum;
}

std::string quoted(std::string text) {
  for (std::size_t k = 0; (k = text.find('"', k)) != std::string::npos; k += 2) text.insert(k, 1, '"');
  return "\"" + text + "\"";
}

std::string number_or_nothing(double y) { return std::isfinite(y) ? shortest(y) : ""; }

// Rows and columns of a family in the order of the catalogue; empty if it has none.
std::string table_of(const std::vector<Result>& results, const std::string& family) {
  std::vector<std::string> rows, columns;
  std::map<std::pair<std::string, std::string>, const Result*> cells;
  const auto note = [](std::vector<std::string>& all, const std::string& one) {
    if (std::ranges::find(all, one) == all.end()) all.push_back(one);
  };
  for (const Result& r : results) {
    if (r.of->family != family || r.of->row.empty()) continue;
    note(rows, r.of->row);
    note(columns, r.of->column);
    cells[{r.of->row, r.of->column}] = &r;
  }
  if (rows.empty()) return "";
  std::vector<std::string> line{""};
  line.insert(line.end(), columns.begin(), columns.end());
  std::string out = "<table>\n" + row(line, "th");
  for (const std::string& name : rows) {
    line = {name};
    for (const std::string& column : columns) {
      const auto found = cells.find({name, column});
      line.push_back(found == cells.end() ? "refuses" : found->second->outcome.cell);
    }
    out += row(line);
  }
  return out + "</table>\n";
}

}  // namespace

std::string summary_text(const std::vector<Result>& results) {
  const Tally sum = total(results);
  return "  " + std::to_string(sum.all) + " cases in " + std::to_string(by_family(results).size()) +
         " families: " + std::to_string(sum.of[0]) + " accurate, " + std::to_string(sum.of[1]) + " bounded, " +
         std::to_string(sum.of[2]) + " refused; " + std::to_string(sum.wrong) + " otherwise than expected\n";
}

std::string json_of(const std::vector<Result>& results) {
  Json all = Json::array();
  for (const Result& r : results) {
    Json one;
    one.set("family", r.of->family);
    one.set("name", r.of->name);
    one.set("expected", name_of(r.of->expected.verdict));
    if (r.of->expected.verdict != Verdict::kRefused) one.set("within", r.of->expected.within);
    if (!r.of->expected.reason.empty()) one.set("reason", r.of->expected.reason);
    one.set("as_expected", r.complaint.empty());
    if (!r.complaint.empty()) one.set("complaint", r.complaint);
    if (std::isfinite(r.outcome.error)) one.set("error", r.outcome.error), one.set("unit", r.outcome.unit);
    if (!r.outcome.second_way.empty()) one.set("second_way", r.outcome.second_way);
    if (!r.outcome.refusal.empty()) one.set("refusal", r.outcome.refusal);
    if (!r.outcome.what.empty()) one.set("what", r.outcome.what);
    one.set("first_bad", name_of(r.outcome.first_bad));
    if (std::isfinite(r.outcome.energy)) one.set("energy_imbalance", r.outcome.energy);
    one.set("work", r.outcome.work);
    all.push_back(one);
  }
  return all.dump(1) + "\n";
}

std::string csv_of(const std::vector<Result>& results) {
  std::string out = "family,name,expected,within,error,unit,as_expected,first_bad,energy_imbalance,work,refusal,what\n";
  for (const Result& r : results) {
    const bool refusal = r.of->expected.verdict == Verdict::kRefused;
    out += quoted(r.of->family) + ',' + quoted(r.of->name) + ',' + name_of(r.of->expected.verdict) + ',' +
           (refusal ? "" : shortest(r.of->expected.within)) + ',' + number_or_nothing(r.outcome.error) + ',' +
           quoted(r.outcome.unit) + ',' + (r.complaint.empty() ? "yes" : "no") + ',' + name_of(r.outcome.first_bad) +
           ',' + number_or_nothing(r.outcome.energy) + ',' + std::to_string(r.outcome.work) + ',' +
           quoted(r.outcome.refusal) + ',' + quoted(r.outcome.what) + '\n';
  }
  return out;
}

std::string html_of(const std::vector<Result>& results) {
  const Tally sum = total(results);
  std::string out =
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>farhand: stiff and extreme "
      "cases</title><style>" +
      std::string(kTableStyle) + "</style></head><body>\n<h1>Stiff and extreme cases</h1>\n";
  out += "<div class=\"verdict " + std::string(sum.wrong == 0 ? "ok" : "failed") + "\"><b>" +
         (sum.wrong == 0 ? "\u2713 Every case has its expected verdict"
                         : "\u2715 " + std::to_string(sum.wrong) + " cases came out otherwise than expected") +
         "</b><p>" + escaped(summary_text(results)) + "</p></div>\n";
  out +=
      "<p>Accurate: within the stated distance of a second way that shares no code with the first. Bounded: no more "
      "can be promised, for the reason given. Refused: it does not run, or stops, and says why. Energy: largest "
      "imbalance of a plant over what it turned over.</p>\n";
  if (sum.wrong > 0) {
    out += "<h2>Otherwise than expected</h2>\n<table>\n";
    for (const Result& r : results) {
      if (!r.complaint.empty())
        out += row({r.of->family, r.of->name, r.complaint, r.outcome.what}, "td", " class=\"wrong\"");
    }
    out += "</table>\n";
  }
  out += "<h2>Families</h2>\n<table>\n" +
         row({"family", "\tcases", "\taccurate", "\tbounded", "\trefused", "\totherwise"}, "th");
  for (const auto& [name, t] : by_family(results))
    out += row({name, "\t" + std::to_string(t.all), "\t" + std::to_string(t.of[0]), "\t" + std::to_string(t.of[1]),
                "\t" + std::to_string(t.of[2]), "\t" + std::to_string(t.wrong)});
  out += "</table>\n";
  std::string family;
  for (const Result& r : results) {
    if (r.of->family != family) {
      out += (family.empty() ? "" : "</table>\n") + std::string("<h2>") + escaped(r.of->family) + "</h2>\n" +
             table_of(results, r.of->family) + "<table>\n" +
             row({"case", "expected", "\tfound", "judged against", "what happened", "first bad number", "\tenergy",
                  "\twork"},
                 "th");
      family = r.of->family;
    }
    const bool measured = std::isfinite(r.outcome.error) && r.of->expected.verdict != Verdict::kRefused;
    std::string what = r.outcome.refusal.empty() ? r.outcome.what : r.outcome.refusal;
    if (r.of->expected.verdict == Verdict::kBounded) what += " Only bounded: " + r.of->expected.reason;
    out += row({r.of->name, expectation(r.of->expected),
                "\t" + (measured ? three_digits(r.outcome.error) + " " + r.outcome.unit
                                 : std::string(r.outcome.refusal.empty() ? "-" : "refused")),
                r.outcome.second_way, what, r.outcome.first_bad == Block::kNone ? "-" : name_of(r.outcome.first_bad),
                "\t" + three_digits(r.outcome.energy), "\t" + std::to_string(r.outcome.work)},
               "td", r.complaint.empty() ? "" : " class=\"wrong\"");
  }
  out += (family.empty() ? "" : "</table>\n") + std::string("<footer>farhand ") + FARHAND_VERSION +
         ". To reproduce: <code>farhand-lab extreme --report FILE</code>.</footer>\n</body></html>\n";
  return out;
}

}  // namespace farhand::extreme
