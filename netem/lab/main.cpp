// farhand-lab: experiments in virtual time, and what one does to scenes and recordings at a desk.
#include <cstdio>
#include <utility>
#include <vector>

#include "netem/lab/commands.hpp"
#include "netem/lab/workload.hpp"

namespace farhand {
namespace {

int main(int argc, char** argv) {
  Program program("farhand-lab", "Experiments in virtual time; scenes, recordings and reports.");
  Command lab = program.command();
  lab.require_subcommand();
  std::vector<std::pair<Command, Action>> all;
  for (const LabCommand& row : lab_commands()) {
    const Command command = lab.subcommand(row.name, row.purpose);
    all.emplace_back(command, row.add(command));
  }
  return program.run(argc, argv, [&] {
    try {
      for (const auto& [command, action] : all) {
        if (command.given()) return action();
      }
    } catch (const Stopped& stopped) {
      std::fprintf(stderr, "farhand-lab: stopped after %zu of %zu %s; nothing was written\n", stopped.done,
                   stopped.total, stopped.what.c_str());
      return kExitStopped;
    }
    return kExitUsage;  // not reached: one is required
  });
}

}  // namespace
}  // namespace farhand

int main(int argc, char** argv) { return farhand::main(argc, argv); }
