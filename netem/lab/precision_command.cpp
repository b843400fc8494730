#include "netem/lab/precision_command.hpp"

#include <iostream>

#include "netem/lab/precision_report.hpp"
#include "netem/lab/write_to.hpp"

namespace farhand {
Command add_precision(Command program, PrecisionChoice& choice) {
  Command command = program.subcommand(
      "precision", "error of position and force against wall time: every integrator in the bare loop of a scene");
  add_scene_argument(command, choice.scene);
  command.count("--runs", choice.settings.runs, 1, 1000, "how often each is timed");
  command.flag("!--no-cvode", choice.settings.competitor, "without CVODE, which takes most of the time");
  command.output("--json", choice.json, "all numbers as JSON (- is standard output)");
  command.output("--csv", choice.csv, "errors of every tick (- is standard output)");
  command.output("--report", choice.report, "report as one HTML file (- is standard output)");
  return command;
}

int run_precision(PrecisionChoice choice) {
  const PrecisionResult result = measure_precision(choice.scene.load(), choice.settings);
  const bool stdout_taken = choice.json == "-" || choice.csv == "-" || choice.report == "-";
  print_precision(result, stdout_taken ? std::cerr : std::cout);
  write_to(choice.json, [&](std::ostream& out) { out << precision_json(result); });
  write_to(choice.csv, [&](std::ostream& out) { write_precision_csv(result, out); });
  write_to(choice.report, [&](std::ostream& out) { out << precision_html(result); });
  return kExitOk;
}

}  // namespace farhand
