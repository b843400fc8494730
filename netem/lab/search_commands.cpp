// Many sessions at once, or the same in many ways.
#include <algorithm>
#include <chrono>
#include <iomanip>
#include <iostream>
#include <memory>
#include <optional>
#include <stdexcept>

#include "common/runtime/program.hpp"
#include "netem/lab/commands.hpp"
#include "netem/lab/extreme_report.hpp"
#include "netem/lab/fault_report.hpp"
#include "netem/lab/limits_report.hpp"
#include "netem/lab/precision_report.hpp"
#include "netem/lab/rogue_report.hpp"
#include "netem/lab/sweep.hpp"
#include "netem/lab/workload.hpp"
#include "netem/lab/write_to.hpp"

namespace farhand {
namespace {

constexpr const char* kThreads = "0: one per core; the results are the same for any number";

class Stopwatch {
 public:
  double s() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - begun_).count(); }

 private:
  std::chrono::steady_clock::time_point begun_ = std::chrono::steady_clock::now();
};

struct LimitsChoice {
  std::string csv, report;
};

int run_limits(const LimitsChoice& choice) {
  const std::vector<LimitMap> maps = limit_maps();
  const std::vector<WallLimits> walls = wall_limits();
  write_to(choice.csv, [&](std::ostream& out) { write_limits_csv(maps, out); });
  write_to(choice.report, [&](std::ostream& out) { out << limits_html(maps, walls); });
  print_limits(maps, walls, choice.csv == "-" || choice.report == "-" ? std::cerr : std::cout);
  return kExitOk;
}

struct PrecisionChoice {
  SceneChoice scene;
  PrecisionSettings settings;
  std::string json, csv, report;
};

int run_precision(const PrecisionChoice& choice) {
  const LoadedScene loaded = choice.scene.load();
  const PrecisionResult result = measure_precision(loaded, choice.settings, Workload(1, "integrators"));
  const bool stdout_taken = choice.json == "-" || choice.csv == "-" || choice.report == "-";
  print_precision(result, stdout_taken ? std::cerr : std::cout);
  write_to(choice.json, [&](std::ostream& out) { out << precision_json(result); });
  write_to(choice.csv, [&](std::ostream& out) { write_precision_csv(result, out); });
  write_to(choice.report, [&](std::ostream& out) { out << precision_html(result); });
  return kExitOk;
}

struct SweepChoice {
  SceneChoice scene;
  int threads = 0;
  std::string csv = "-";
};

int run_sweep(const SweepChoice& choice) {
  const SweepAsked asked = swept(choice.scene.scene, choice.scene.sets, choice.scene.seed);
  const Workload work(choice.threads, "scenes");
  const Stopwatch wall;
  Swept done;
  write_to(
      choice.csv, [&](std::ostream& out) { done = sweep(asked, work, out); }, Partial::kKept);
  const double wall_s = wall.s();
  std::cerr << done.rows << (done.rows < asked.scenes() ? " of " + std::to_string(asked.scenes()) : "") << " scenes, "
            << done.failed << " with the verdict failed, " << done.refused << " refused, in " << std::setprecision(3)
            << wall_s << " s on " << work.threads() << " threads, " << static_cast<double>(done.rows) / wall_s
            << " a second\n";
  if (done.rows < asked.scenes()) return kExitStopped;
  return done.refused == done.rows ? kExitUsage : kExitOk;
}

struct ExtremeChoice {
  std::string family;  // empty: all
  int threads = 0;     // 0: as many as there are cores
  std::string json, csv, report;
};

int run_extreme(const ExtremeChoice& choice) {
  std::vector<extreme::Case> cases = extreme::catalogue();
  std::erase_if(cases, [&](const extreme::Case& c) { return c.family.find(choice.family) == std::string::npos; });
  if (cases.empty()) throw std::invalid_argument("no family contains '" + choice.family + "'");
  const Workload work(choice.threads, "cases");
  const Stopwatch wall;
  const std::vector<extreme::Result> results = extreme::run(cases, work);
  const double wall_s = wall.s();

  const bool stdout_taken = choice.json == "-" || choice.csv == "-" || choice.report == "-";
  std::ostream& out = stdout_taken ? std::cerr : std::cout;
  std::size_t wrong = 0;
  for (const extreme::Result& r : results) {
    out << (r.complaint.empty() ? "  as expected  " : "  OTHERWISE    ") << std::left << std::setw(9)
        << extreme::name_of(r.of->expected.verdict) << std::setw(11) << std::setprecision(3) << r.outcome.error
        << std::right << r.of->family << ": " << r.of->name << '\n';
    if (!r.complaint.empty()) out << "      " << r.complaint << "\n      " << r.outcome.what << '\n';
    wrong += !r.complaint.empty();
  }
  const auto slowest = std::ranges::max_element(results, {}, &extreme::Result::wall_s);
  out << extreme::summary_text(results) << "  longest: " << slowest->of->family << ", " << slowest->of->name << ", "
      << std::setprecision(3) << slowest->wall_s << " s\n"
      << "  " << std::setprecision(3) << wall_s << " s on " << work.threads() << " threads\n";
  write_to(choice.json, [&](std::ostream& to) { to << extreme::json_of(results); });
  write_to(choice.csv, [&](std::ostream& to) { to << extreme::csv_of(results); });
  write_to(choice.report, [&](std::ostream& to) { to << extreme::html_of(results); });
  return wrong == 0 ? kExitOk : kExitVerdictFailed;
}

struct FaultsChoice {
  std::string fault;  // empty: all
  std::string json, report;
};

int run_faults(const FaultsChoice& choice) {
  std::vector<faults::Row> rows = faults::rows();
  std::erase_if(rows, [&](const faults::Row& row) { return row.fault.find(choice.fault) == std::string::npos; });
  if (rows.empty()) throw std::invalid_argument("no fault contains '" + choice.fault + "'");
  const std::vector<faults::Result> results = faults::run(rows, Workload(0, "rows"));
  (choice.json == "-" || choice.report == "-" ? std::cerr : std::cout) << faults::text_of(results);
  write_to(choice.json, [&](std::ostream& out) { out << faults::json_of(results); });
  write_to(choice.report, [&](std::ostream& out) { out << faults::html_of(results); });
  const bool fine = std::ranges::all_of(results, [](const faults::Result& r) { return r.complaint.empty(); });
  return fine ? kExitOk : kExitVerdictFailed;
}

struct RogueChoice {
  std::string against;  // patient, therapist or empty: both
  std::string cell;     // only cells whose name contains this
  std::string replay;   // a row to run instead of a search
  int sessions = 1000, threads = 0;
  std::optional<std::uint64_t> seed;
  std::string json, report;
};

int run_rogue(const RogueChoice& choice) {
  if (!choice.replay.empty()) {
    const rogue::Row row = rogue::row_of(choice.replay);
    const rogue::Outcome outcome = rogue::Arena(row.cell).run(row.genome);
    std::cout << rogue::text_of(outcome);
    return outcome.ratio() <= 1 ? kExitOk : kExitVerdictFailed;
  }
  if (!choice.against.empty() && choice.against != "patient" && choice.against != "therapist")
    throw std::invalid_argument("--against is patient or therapist, not '" + choice.against + "'");
  std::vector<rogue::Cell> cells = rogue::all_cells();
  std::erase_if(cells, [&](const rogue::Cell& cell) {
    const std::string name = rogue::name_of(cell);
    return !name.starts_with(choice.against) || name.find(choice.cell) == std::string::npos;
  });
  if (cells.empty()) throw std::invalid_argument("no cell's name contains '" + choice.cell + "'");
  const rogue::Budget budget{.sessions = choice.sessions, .seed = choice.seed.value_or(1)};
  const Workload work(choice.threads, "sessions");
  const Stopwatch wall;
  const std::vector<rogue::CellResult> results = rogue::search(cells, budget, work);
  const double wall_s = wall.s();

  std::ostream& out = choice.json == "-" || choice.report == "-" ? std::cerr : std::cout;
  out << rogue::text_of(results) << "  " << budget.sessions << " sessions in each cell, seed " << budget.seed << ", "
      << std::setprecision(3) << wall_s << " s on " << work.threads() << " threads\n";
  const std::string rows = rogue::rows_of(results, 1.0);
  if (!rows.empty()) out << "  The worst row across each line of each cell, to be replayed:\n" << rows;
  write_to(choice.json, [&](std::ostream& to) { to << rogue::json_of(results, budget); });
  write_to(choice.report, [&](std::ostream& to) { to << rogue::html_of(results, budget); });
  return rows.empty() ? kExitOk : kExitVerdictFailed;
}

}  // namespace

Action add_limits(Command command) {
  const auto choice = std::make_shared<LimitsChoice>();
  command.output("--csv", choice->csv, "every point of the maps (- is standard output)");
  command.output("--report", choice->report, "the maps as one HTML file (- is standard output)");
  return [choice] { return run_limits(*choice); };
}

Action add_precision(Command command) {
  const auto choice = std::make_shared<PrecisionChoice>();
  add_scene_argument(command, choice->scene);
  command.count("--runs", choice->settings.runs, 1, 1000, "how often each is timed");
  command.flag("!--no-cvode", choice->settings.competitor, "without CVODE, which takes most of the time");
  command.output("--json", choice->json, "all numbers as JSON (- is standard output)");
  command.output("--csv", choice->csv, "errors of every tick (- is standard output)");
  command.output("--report", choice->report, "report as one HTML file (- is standard output)");
  return [choice] { return run_precision(*choice); };
}

Action add_sweep(Command command) {
  const auto choice = std::make_shared<SweepChoice>();
  add_scene_argument(command, choice->scene);
  command.count("--threads", choice->threads, 0, 1024, kThreads);
  command.output("--csv", choice->csv, "table of the results (default - is standard output)");
  return [choice] { return run_sweep(*choice); };
}

Action add_extreme(Command command) {
  const auto choice = std::make_shared<ExtremeChoice>();
  command.text("--family", choice->family, "only families whose name contains this");
  command.count("--threads", choice->threads, 0, 1024, kThreads);
  command.output("--json", choice->json, "results as JSON (- is standard output)");
  command.output("--csv", choice->csv, "results as a table (- is standard output)");
  command.output("--report", choice->report, "results as one HTML file (- is standard output)");
  return [choice] { return run_extreme(*choice); };
}

Action add_faults(Command command) {
  const auto choice = std::make_shared<FaultsChoice>();
  command.text("--fault", choice->fault, "only faults whose name contains this");
  command.output("--json", choice->json, "results as JSON (- is standard output)");
  command.output("--report", choice->report, "results as one HTML file (- is standard output)");
  return [choice] { return run_faults(*choice); };
}

Action add_rogue(Command command) {
  const auto choice = std::make_shared<RogueChoice>();
  command.text("--against", choice->against, "patient or therapist: who is in danger; by default both");
  command.count("--sessions", choice->sessions, 1, 10'000'000, "sessions in each cell, of 3 s or more each");
  command.text("--cell", choice->cell, "only cells whose name contains this, such as WAVE/mcu");
  command.text("--replay", choice->replay,
               "run this row, a cell and a genome as a search prints them, and nothing else");
  command.seed("--seed", choice->seed, "of the search; 1 by default");
  command.count("--threads", choice->threads, 0, 1024, kThreads);
  command.output("--json", choice->json, "results as JSON (- is standard output)");
  command.output("--report", choice->report, "results as one HTML file (- is standard output)");
  command.alone("--replay");
  return [choice] { return run_rogue(*choice); };
}

}  // namespace farhand
