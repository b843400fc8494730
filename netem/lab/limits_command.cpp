#include "netem/lab/limits_command.hpp"

#include "common/runtime/program.hpp"
#include "netem/lab/limits_report.hpp"
#include "netem/lab/write_to.hpp"

namespace farhand {

Command add_limits(Command program, LimitsChoice& choice) {
  Command command = program.subcommand("limits", "where observers, force loop and sampled walls cease to be stable");
  command.output("--csv", choice.csv, "every point of the maps (- is standard output)");
  command.output("--report", choice.report, "the maps as one HTML file (- is standard output)");
  return command;
}

int run_limits(const LimitsChoice& choice) {
  const std::vector<LimitMap> maps = limit_maps();
  const std::vector<WallLimits> walls = wall_limits();
  write_to(choice.csv, [&](std::ostream& out) { write_limits_csv(maps, out); });
  write_to(choice.report, [&](std::ostream& out) { out << limits_html(maps, walls); });
  print_limits(maps, walls, choice.csv == "-" || choice.report == "-" ? std::cerr : std::cout);
  return kExitOk;
}

}  // namespace farhand
