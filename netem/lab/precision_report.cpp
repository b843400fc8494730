#include "netem/lab/precision_report.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <iomanip>
#include <sstream>

#include "common/config/json.hpp"
#include "common/judge/digits.hpp"
#include "common/show/format.hpp"
#include "common/show/plot.hpp"
#include "common/show/report.hpp"

namespace farhand {
namespace {

using Pick = PrecisionError PrecisionRow::*;

const char* const kShiftsOnly =
    "At this damping the leading error of a step only shifts contacts in time, so the next order shows.";
const char* const kDistinct =
    "No step is longer than an input is held: where several tolerances lead to the very same steps, they are shown "
    "once.";

// Shortest form: 1e-9.
std::string tolerance(double rtol) {
  std::array<char, 64> buffer;
  std::string out(buffer.data(),
                  std::to_chars(buffer.data(), buffer.data() + buffer.size(), rtol, std::chars_format::scientific).ptr);
  const std::size_t zero = out.find("e-0");
  return zero == std::string::npos ? out : out.erase(zero + 2, 1);
}
std::string setting(const PrecisionRow& row) {
  const BareChoice& choice = row.choice;
  if (takes_a_step(choice.method)) return three_digits(1e6 * choice.step_s) + " us";
  if (takes_a_tolerance(choice.method)) return (row.looser_too ? "rtol >= " : "rtol ") + tolerance(choice.rtol);
  return "-";
}
std::string name(const PrecisionRow& row) {
  return std::string(name_of(row.choice.method)) + (row.quantised ? ", encoder counts" : "") +
         (row.is_default ? " *" : "");
}
const FittedOrder* fit_of(const PrecisionResult& result, BareMethod method) {
  const auto found = std::find_if(result.orders.begin(), result.orders.end(),
                                  [&](const FittedOrder& o) { return o.method == method; });
  return found == result.orders.end() ? nullptr : &*found;
}
std::string range_of(const FittedOrder& fit) {
  const std::string points = std::to_string(fit.points) + (fit.points == 1 ? " point" : " points");
  if (fit.points < 2) return points;
  return points + ", " + three_digits(1e6 * fit.finest_s) + " to " + three_digits(1e6 * fit.coarsest_s) + " us";
}
std::string fixed(double y, int digits) {
  std::array<char, 64> buffer;
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), y, std::chars_format::fixed, digits);
  return std::isfinite(y) ? std::string(buffer.data(), end.ptr) : "-";
}
std::string shortest(double y) {
  std::array<char, 64> buffer;
  return std::string(buffer.data(), std::to_chars(buffer.data(), buffer.data() + buffer.size(), y).ptr);
}

void put(Json& to, const PrecisionError& e, const std::string& what, const std::string& unit) {
  to.set(what + "_end_" + unit, e.end);
  to.set(what + "_rms_" + unit, e.rms);
  to.set(what + "_max_" + unit, e.max);
  to.set(what + "_growth", e.growth);
}

// Error against wall time of some methods; the same axes in every picture of one quantity.
class Picture {
 public:
  Picture(const PrecisionResult& result, Pick pick, std::string title, std::string unit)
      : result_(result),
        pick_(pick),
        plot_(std::move(title), {"wall time per simulated second (s)", least_wall(), most_wall(), true},
              {"largest error (" + unit + ")", least(), 10 * greatest(), true}, 960, 420) {}

  void add(BareMethod method, Ink ink, Symbol symbol, bool quantised = false) {
    std::vector<double> wall, error;
    for (const PrecisionRow& row : result_.rows) {
      if (row.choice.method != method || row.quantised != quantised || !row.ok() || row.wall_s.empty()) continue;
      wall.push_back(row.wall_median());
      error.push_back(std::max((row.*pick_).max, least()));
      plot_.loop("", {row.wall_s.front(), row.wall_s.back()}, {error.back(), error.back()}, Ink::kGrey);
    }
    if (wall.empty()) return;
    std::string label(name_of(method));
    const FittedOrder* fit = quantised ? nullptr : fit_of(result_, method);
    const double order = fit == nullptr ? NAN : pick_ == &PrecisionRow::position ? fit->position : fit->force;
    if (std::isfinite(order)) label += ", order " + fixed(order, 2);
    if (quantised) label += ", encoder counts";
    const bool joined = wall.size() > 1 && !quantised;
    if (joined) plot_.loop(label, wall, error, ink);
    plot_.points(joined ? "" : label, wall, error, ink, symbol);
  }

  std::string svg() {
    for (const PrecisionRow& row : result_.rows) {
      if (!row.is_default || row.wall_s.empty()) continue;
      // Where the default is the closed form, it is one and the same run: one place.
      const PrecisionRow* closed = result_.find({BareMethod::kClosedForm, 0, 0});
      const PrecisionRow& at = closed && closed->position_error == row.position_error ? *closed : row;
      if (!at.wall_s.empty()) plot_.mark(at.wall_median(), std::max((at.*pick_).max, least()), "default of this scene");
    }
    const bool position = pick_ == &PrecisionRow::position;
    const PrecisionError& floor = position ? result_.floor_position : result_.floor_force;
    plot_.rule(std::max(floor.max, least()), "error of the reference, " + three_digits(floor.max));
    return plot_.svg();
  }

 private:
  // What is smaller, or 0, is drawn there: a hundredth of what rounding or the reference leaves.
  double least() const {
    double out = (pick_ == &PrecisionRow::position ? result_.floor_position : result_.floor_force).max;
    for (const PrecisionRow& row : result_.rows)
      if (row.ok() && (row.*pick_).max > 0) out = std::min(out, (row.*pick_).max);
    return std::max(out / 100, 1e-20);
  }
  double greatest() const {
    double out = 1e-9;
    for (const PrecisionRow& row : result_.rows)
      if (row.ok() && std::isfinite((row.*pick_).max)) out = std::max(out, (row.*pick_).max);
    return out;
  }
  double least_wall() const {
    double out = 1;
    for (const PrecisionRow& row : result_.rows)
      if (!row.wall_s.empty()) out = std::min(out, row.wall_s.front());
    return out / 1.5;
  }
  double most_wall() const {
    double out = 0;
    for (const PrecisionRow& row : result_.rows)
      if (!row.wall_s.empty()) out = std::max(out, row.wall_s.back());
    return out * 1.5;
  }

  const PrecisionResult& result_;
  Pick pick_;
  Plot plot_;
};

std::string work_precision(const PrecisionResult& result, Pick pick, const std::string& what, const std::string& unit) {
  Picture steps(result, pick, what + ": fixed steps", unit);
  steps.add(BareMethod::kSemiImplicitEuler, Ink::kGrey, Symbol::kCircle);
  steps.add(BareMethod::kRk4, Ink::kMaster, Symbol::kCircle);
  steps.add(BareMethod::kSdirk2, Ink::kSlave, Symbol::kSquare);
  steps.add(BareMethod::kRosenbrock, Ink::kMasterPale, Symbol::kCross);
  steps.add(BareMethod::kRk4, Ink::kGrey, Symbol::kCross, true);
  steps.add(BareMethod::kClosedForm, Ink::kBlack, Symbol::kSquare);
  Picture tolerances(result, pick, what + ": tolerances", unit);
  tolerances.add(BareMethod::kAdaptive, Ink::kMaster, Symbol::kCircle);
  tolerances.add(BareMethod::kCvodeBdf, Ink::kSlave, Symbol::kSquare);
  tolerances.add(BareMethod::kCvodeAdams, Ink::kMasterPale, Symbol::kCross);
  tolerances.add(BareMethod::kClosedForm, Ink::kBlack, Symbol::kSquare);
  return steps.svg() + tolerances.svg();
}

std::string error_over_time(const PrecisionResult& result, bool force) {
  Plot plot(force ? "Error of force over simulated time" : "Error of position over simulated time",
            {"simulated time (s)", 0, result.duration_s, false},
            {force ? "error (N m)" : "error (rad)", 1e-18, NAN, true}, 960, 420);
  const auto draw = [&](const PrecisionRow* row, Ink ink) {
    if (!row || !row->ok()) return;
    const std::vector<double>& error = force ? row->force_error : row->position_error;
    std::vector<double> t(error.size());
    for (std::size_t k = 0; k < t.size(); ++k) t[k] = static_cast<double>(k + 1) * result.tick_s;
    plot.line(name(*row) + (setting(*row) == "-" ? "" : ", " + setting(*row)), std::move(t), error, ink);
  };
  const double step = result.hold_s / 20;
  draw(result.find({BareMethod::kSemiImplicitEuler, step, 0}), Ink::kGrey);
  draw(result.find({BareMethod::kSdirk2, step, 0}), Ink::kSlave);
  draw(result.find({BareMethod::kRosenbrock, step, 0}), Ink::kMasterPale);
  draw(result.find({BareMethod::kRk4, step, 0}), Ink::kMaster);
  const PrecisionRow* adaptive = result.find({BareMethod::kAdaptive, 0, 1e-9});
  for (const PrecisionRow& row : result.rows) {  // or the loosest that is left
    if (adaptive == nullptr && row.choice.method == BareMethod::kAdaptive) adaptive = &row;
  }
  draw(adaptive, Ink::kSlavePale);
  draw(result.find({BareMethod::kClosedForm, 0, 0}), Ink::kBlack);
  return plot.svg();
}

std::string cell(const std::string& words, bool numeric = true) {
  return std::string(numeric ? "<td class=\"n\">" : "<td>") + escaped(words) + "</td>";
}

std::string table(const PrecisionResult& result) {
  std::string out =
      "<table class=\"long\" style=\"font-size:11px;white-space:nowrap\"><tr><th>integrator</th><th "
      "class=\"n\">step, rtol</th><th class=\"n\">wall us per s</th><th class=\"n\">least to most</th><th "
      "class=\"n\">position: end</th><th class=\"n\">RMS</th><th class=\"n\">largest (rad)</th><th class=\"n\">force: "
      "end</th><th class=\"n\">RMS</th><th class=\"n\">largest (N m)</th><th "
      "class=\"n\">growth</th><th>ended</th></tr>\n";
  for (const PrecisionRow& row : result.rows) {
    out += "<tr>" + cell(name(row), false) + cell(setting(row));
    out += cell(row.wall_s.empty() ? "-" : three_digits(1e6 * row.wall_median()));
    out += cell(row.wall_s.size() < 2
                    ? "-"
                    : three_digits(1e6 * row.wall_s.front()) + " to " + three_digits(1e6 * row.wall_s.back()));
    for (const PrecisionError* e : {&row.position, &row.force})
      out += cell(three_digits(e->end)) + cell(three_digits(e->rms)) + cell(three_digits(e->max));
    out += cell(three_digits(row.position.growth)) + cell(row.ok() ? "ok" : row.failure, false) + "</tr>\n";
  }
  return out + "</table>\n";
}

}  // namespace

void print_precision(const PrecisionResult& result, std::ostream& out) {
  out << "scene " << result.scene << ", " << result.duration_s << " s, both sides in the bare loop, ideal encoders\n"
      << "reference: " << result.reference << '\n'
      << "  error of the reference, largest: " << three_digits(result.floor_position.max) << " rad, "
      << three_digits(result.floor_force.max) << " N m\n"
      << "  second: " << result.second << "; they differ by at most " << three_digits(result.second_position.max)
      << " rad, " << three_digits(result.second_force.max) << " N m\n"
      << (result.without.empty() ? "" : result.without + "\n") << '\n';
  const auto row_of = [&out](const std::string& a, const std::string& b, const std::string& c, const std::string& d,
                             const std::array<std::string, 6>& e, const std::string& growth, const std::string& end) {
    out << std::left << std::setw(24) << a << std::right << std::setw(14) << b << std::setw(10) << c << std::setw(16)
        << d;
    for (const std::string& word : e) out << std::setw(11) << word;
    out << std::setw(10) << growth << "  " << end << '\n';
  };
  row_of("", "step or", "wall us", "least to", {"position", "rad", "", "force", "N m", ""}, "", "");
  row_of("integrator", "tolerance", "per s", "most", {"end", "RMS", "largest", "end", "RMS", "largest"}, "growth", "");
  for (const PrecisionRow& row : result.rows) {
    std::array<std::string, 6> errors;
    std::size_t k = 0;
    for (const PrecisionError* e : {&row.position, &row.force})
      for (const double y : {e->end, e->rms, e->max}) errors[k++] = three_digits(y);
    const bool timed = !row.wall_s.empty();
    row_of(name(row), setting(row), timed ? three_digits(1e6 * row.wall_median()) : "-",
           timed ? three_digits(1e6 * row.wall_s.front()) + ".." + three_digits(1e6 * row.wall_s.back()) : "-", errors,
           three_digits(row.position.growth), row.failure);
  }
  out << "\n* default of this scene: " << result.methods
      << ". growth: RMS error of the last quarter over that of the worst quarter. " << kDistinct << "\n\n"
      << "orders of convergence, fitted to the RMS error above the floor\n";
  for (const FittedOrder& fit : result.orders) {
    out << "  " << std::left << std::setw(22) << name_of(fit.method) << std::right << "theory " << fit.theory
        << ", position " << fixed(fit.position, 2) << ", force " << fixed(fit.force, 2) << " (" << range_of(fit)
        << ")\n";
    if (fit.shifts_only) out << "    " << kShiftsOnly << '\n';
  }
}

std::string precision_json(const PrecisionResult& result) {
  Json out, orders = Json::array(), rows = Json::array();
  out.set("scene", result.scene);
  out.set("duration_s", result.duration_s);
  out.set("runs", result.runs);
  out.set("reference", result.reference);
  out.set("second_reference", result.second);
  out.set("cvode", result.without.empty() ? "beside" : result.without);
  put(out, result.floor_position, "floor_position", "rad");
  put(out, result.floor_force, "floor_force", "nm");
  put(out, result.second_position, "second_position", "rad");
  put(out, result.second_force, "second_force", "nm");
  for (const FittedOrder& fit : result.orders) {
    orders.push_back(Json::object({{"integrator", name_of(fit.method)},
                                   {"theory", fit.theory},
                                   {"position", fit.position},
                                   {"force", fit.force},
                                   {"finest_s", fit.finest_s},
                                   {"coarsest_s", fit.coarsest_s},
                                   {"leading_error_shifts_contacts_only", fit.shifts_only},
                                   {"points", fit.points}}));
  }
  for (const PrecisionRow& row : result.rows) {
    Json one;
    one.set("integrator", name_of(row.choice.method));
    if (takes_a_step(row.choice.method)) one.set("step_s", row.choice.step_s);
    if (takes_a_tolerance(row.choice.method)) one.set("rtol", row.choice.rtol);
    one.set("quantised", row.quantised);
    one.set("default", row.is_default);
    one.set("ended", row.ok() ? "ok" : row.failure);
    put(one, row.position, "position", "rad");
    put(one, row.force, "force", "nm");
    one.set("steps", row.steps);
    one.set("events", row.events);
    if (!row.wall_s.empty()) {
      one.set("wall_s_per_s", row.wall_median());
      one.set("wall_least_s_per_s", row.wall_s.front());
      one.set("wall_most_s_per_s", row.wall_s.back());
    }
    rows.push_back(one);
  }
  out.set("orders", orders);
  out.set("rows", rows);
  return out.dump(2) + "\n";
}

void write_precision_csv(const PrecisionResult& result, std::ostream& out) {
  out << "t_s";
  for (const PrecisionRow& row : result.rows) {
    const std::string head = name(row) + " " + setting(row);
    out << ",\"" << head << " position rad\",\"" << head << " force nm\"";
  }
  out << '\n';
  const std::size_t ticks = result.rows.empty() ? 0 : result.rows.front().position_error.size();
  for (std::size_t k = 0; k < ticks; ++k) {
    out << shortest(static_cast<double>(k + 1) * result.tick_s);
    for (const PrecisionRow& row : result.rows)
      out << ',' << shortest(row.position_error[k]) << ',' << shortest(row.force_error[k]);
    out << '\n';
  }
}

std::string precision_html(const PrecisionResult& result) {
  const auto p = [](const std::string& words) { return "<p>" + escaped(words) + "</p>\n"; };
  const auto note = [](const std::string& words) { return "<p class=\"note\">" + escaped(words) + "</p>\n"; };
  std::string out = "<h1>Precision of scene " + escaped(result.scene) + "</h1>\n<p class=\"under\">" +
                    three_digits(result.duration_s) + " s, both sides in the bare loop, ideal encoders; " +
                    (result.runs == 1 ? "each is timed once"
                                      : "each time is the median of " + std::to_string(result.runs) + " runs") +
                    "</p>\n";
  const auto chosen =
      std::find_if(result.rows.begin(), result.rows.end(), [](const PrecisionRow& row) { return row.is_default; });
  if (chosen != result.rows.end()) {
    out += "<div class=\"verdict ok\"><b>" +
           escaped("As it is run by default, this scene is accurate to " + three_digits(chosen->position.max) + " rad" +
                   " and " + three_digits(chosen->force.max) + " N m") +
           "</b>\n" +
           p("By " + result.methods + ", " + three_digits(1e6 * chosen->wall_median()) +
             " us of wall time per simulated second.") +
           "</div>\n";
  }
  out += p("Reference: " + result.reference +
           ". Largest error of the reference: " + three_digits(result.floor_position.max) + " rad, " +
           three_digits(result.floor_force.max) + " N m. Second opinion: " + result.second +
           ", which differs by at most " + three_digits(result.second_position.max) + " rad and " +
           three_digits(result.second_force.max) + " N m. " + result.without);
  out += "<h2>Error against wall time</h2>\n" + work_precision(result, &PrecisionRow::position, "Position", "rad") +
         work_precision(result, &PrecisionRow::force, "Force", "N m");
  out += note(
      "Bars: least and most of the timed runs. Orders are fitted to the RMS error over those points that lie above the "
      "floor; runs with encoder counts are compared with the same encoders without step error, and are not fitted. " +
      std::string(kDistinct));
  for (const FittedOrder& fit : result.orders)
    if (fit.shifts_only) out += note(std::string(name_of(fit.method)) + ": " + kShiftsOnly);
  out += "<h2>Does the error grow?</h2>\n" + error_over_time(result, false) + error_over_time(result, true);
  out += "<h2>All numbers</h2>\n" + table(result);
  out += note("* default of this scene: " + result.methods +
              ". Growth: RMS error of the last quarter over that of the worst quarter.");
  out += "<footer>\n" + p("farhand " FARHAND_VERSION ". " + library_versions() + ".") +
         p("To reproduce: save the scene below as scene.txtpb and run") +
         "<pre>farhand-lab precision ./scene.txtpb --report precision.html</pre>\n<h3>Scene, with every default filled "
         "in</h3>\n<pre>" +
         escaped(result.scene_text) + "</pre>\n</footer>\n";
  return html_page("farhand: precision of " + result.scene, out);
}

}  // namespace farhand
