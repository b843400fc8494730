#include "tests/lab/explain_command.hpp"

#include <CLI/CLI.hpp>
#include <cmath>
#include <fstream>
#include <iomanip>
#include <iostream>

#include "tests/lab/explain_text.hpp"

namespace farhand {

CLI::App* add_explain(CLI::App& app, ExplainChoice& choice) {
  CLI::App* command = app.add_subcommand(
      "explain",
      "the blocks of a scene and those it leaves out, each with reason, time and bytes, and its integrators");
  command->add_option("SCENE", choice.scene.scene, "name of a shipped scene, or path of a scene file")->required();
  add_set_options(*command, choice.scene);
  command->add_option("--json", choice.json,
                      "the same as JSON; what the wall clock measured stands under wall_clock "
                      "(- is standard output)");
  return command;
}

int explain_scene(const ExplainChoice& choice) {
  const Explanation explanation = explain(choice.scene.load());
  if (choice.json == "-") {
    std::cout << json_text(explanation) << '\n';
    return kExitOk;
  }
  print_explanation(explanation, std::cout);
  if (choice.json.empty()) return kExitOk;
  std::ofstream file(choice.json);
  file << json_text(explanation) << '\n';
  file.close();
  if (!file) throw std::runtime_error("cannot write " + choice.json);
  return kExitOk;
}

}  // namespace farhand
