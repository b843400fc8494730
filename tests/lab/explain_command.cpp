#include "tests/lab/explain_command.hpp"

#include <CLI/CLI.hpp>
#include <iostream>

#include "tests/lab/explain_text.hpp"
#include "tests/lab/write_to.hpp"

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
  if (choice.json != "-") print_explanation(explanation, std::cout);
  write_to(choice.json, [&](std::ostream& to) { to << json_text(explanation) << '\n'; });
  return kExitOk;
}

}  // namespace farhand
