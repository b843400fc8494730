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
  // Binds its options to a choice of its own; the action runs it with what was chosen.
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

// Many at once, or the same in many ways.
Action add_limits(Command command);
Action add_precision(Command command);
Action add_sweep(Command command);
Action add_extreme(Command command);
Action add_faults(Command command);
Action add_rogue(Command command);

}  // namespace farhand
