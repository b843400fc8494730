#include "tests/lab/precision_command.hpp"

#include <CLI/CLI.hpp>
#include <iostream>

#include "tests/lab/precision_report.hpp"
#include "tests/lab/write_to.hpp"

namespace farhand {
CLI::App* add_precision(CLI::App& app, PrecisionChoice& choice) {
  CLI::App* command = app.add_subcommand(
      "precision", "error of position and force against wall time: every integrator in the bare loop of a scene");
  command->add_option("SCENE", choice.scene.scene, "name of a shipped scene, or path of a scene file")->required();
  add_set_options(*command, choice.scene);
  command->add_option("--runs", choice.settings.runs, "how often each is timed")->check(CLI::Range(1, 1000));
  command->add_flag("!--no-cvode", choice.settings.competitor, "without CVODE, which takes most of the time");
  command->add_option("--json", choice.json, "all numbers as JSON (- is standard output)");
  command->add_option("--csv", choice.csv, "errors of every tick (- is standard output)");
  command->add_option("--report", choice.report, "report as one HTML file (- is standard output)");
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
