#include "netem/lab/rogue_command.hpp"

#include <algorithm>
#include <chrono>
#include <iomanip>
#include <iostream>
#include <stdexcept>
#include <thread>

#include "common/runtime/program.hpp"
#include "netem/lab/rogue_report.hpp"
#include "netem/lab/write_to.hpp"

namespace farhand {

Command add_rogue(Command program, RogueChoice& choice) {
  Command command = program.subcommand(
      "rogue",
      "search for what a peer with the right key, or an MCU that lies, can do to a person; exit code 3 if a line is "
      "crossed");
  command.text("--against", choice.against, "patient or therapist: who is in danger; by default both");
  command.count("--sessions", choice.sessions, 1, 10'000'000, "sessions in each cell, of 3 s or more each");
  command.text("--cell", choice.cell, "only cells whose name contains this, such as WAVE/mcu");
  command.text("--replay", choice.replay,
               "run this row, a cell and a genome as a search prints them, and nothing else");
  command.seed("--seed", choice.seed, "of the search; 1 by default");
  command.count("--threads", choice.threads, 0, 1024, "0: one per core; the results are the same for any number");
  command.output("--json", choice.json, "results as JSON (- is standard output)");
  command.output("--report", choice.report, "results as one HTML file (- is standard output)");
  command.alone("--replay");
  return command;
}

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
  const int cores = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  const rogue::Budget budget{choice.sessions, choice.seed.value_or(1), choice.threads > 0 ? choice.threads : cores};
  const auto start = std::chrono::steady_clock::now();
  const std::vector<rogue::CellResult> results = rogue::search(cells, budget);
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();

  std::ostream& out = choice.json == "-" || choice.report == "-" ? std::cerr : std::cout;
  out << rogue::text_of(results) << "  " << budget.sessions << " sessions in each cell, seed " << budget.seed << ", "
      << std::setprecision(3) << wall_s << " s on " << budget.threads << " threads\n";
  const std::string rows = rogue::rows_of(results, 1.0);
  if (!rows.empty()) out << "  The worst row across each line of each cell, to be replayed:\n" << rows;
  write_to(choice.json, [&](std::ostream& to) { to << rogue::json_of(results, budget); });
  write_to(choice.report, [&](std::ostream& to) { to << rogue::html_of(results, budget); });
  return rows.empty() ? kExitOk : kExitVerdictFailed;
}

}  // namespace farhand
