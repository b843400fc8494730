#include "netem/lab/faults_command.hpp"

#include <algorithm>
#include <stdexcept>

#include "common/runtime/program.hpp"
#include "netem/lab/fault_report.hpp"
#include "netem/lab/write_to.hpp"

namespace farhand {

Command add_faults(Command program, FaultsChoice& choice) {
  Command command = program.subcommand(
      "faults", "run the fault matrix in virtual time; exit code 3 if a row comes out otherwise than expected");
  command.text("--fault", choice.fault, "only faults whose name contains this");
  command.output("--json", choice.json, "results as JSON (- is standard output)");
  command.output("--report", choice.report, "results as one HTML file (- is standard output)");
  return command;
}

int run_faults(const FaultsChoice& choice) {
  std::vector<faults::Row> rows = faults::rows();
  std::erase_if(rows, [&](const faults::Row& row) { return row.fault.find(choice.fault) == std::string::npos; });
  if (rows.empty()) throw std::invalid_argument("no fault contains '" + choice.fault + "'");
  const std::vector<faults::Result> results = faults::run(rows, 2);
  (choice.json == "-" || choice.report == "-" ? std::cerr : std::cout) << faults::text_of(results);
  write_to(choice.json, [&](std::ostream& out) { out << faults::json_of(results); });
  write_to(choice.report, [&](std::ostream& out) { out << faults::html_of(results); });
  const bool fine = std::ranges::all_of(results, [](const faults::Result& r) { return r.complaint.empty(); });
  return fine ? kExitOk : kExitVerdictFailed;
}

}  // namespace farhand
