// The commands of farhand-lab, one row each.
#pragma once

#include <functional>
#include <span>

#include "common/runtime/command.hpp"

namespace farhand {

using Action = std::function<int()>;  // the exit code

struct LabCommand {
  const char* name;
  const char* purpose;
  // Binds the command's options to variables; the action runs the command with their values.
  Action (*add)(Command command);
};

// As --help lists them.
std::span<const LabCommand> lab_commands();

// At a desk: scenes and recordings.
Action add_check(Command command);
Action add_schema(Command command);
Action add_directory(Command command);
Action add_report(Command command);
Action add_recording(Command command);
Action add_identify(Command command);

// Sessions in virtual time.
Action add_run(Command command);
Action add_compare(Command command);
Action add_endure(Command command);
Action add_explain(Command command);

// Many sessions at once, or one in many variants.
Action add_limits(Command command);
Action add_precision(Command command);
Action add_sweep(Command command);
Action add_extreme(Command command);
Action add_faults(Command command);
Action add_rogue(Command command);

}  // namespace farhand
