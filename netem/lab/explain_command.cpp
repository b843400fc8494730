#include "netem/lab/explain_command.hpp"

#include <iostream>

#include "netem/lab/explain_text.hpp"
#include "netem/lab/write_to.hpp"

namespace farhand {

Command add_explain(Command program, ExplainChoice& choice) {
  Command command = program.subcommand(
      "explain",
      "the blocks of a scene and those it leaves out, each with reason, time and bytes, and its integrators");
  add_scene_argument(command, choice.scene);
  command.output("--json", choice.json,
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
