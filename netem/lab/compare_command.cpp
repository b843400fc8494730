#include "netem/lab/compare_command.hpp"

#include "netem/lab/compare_report.hpp"
#include "netem/lab/write_to.hpp"

namespace farhand {

Command add_compare(Command program, CompareChoice& choice) {
  Command command = program.subcommand("compare", "sessions side by side: recordings of processes, and scenes run now");
  command.texts("SESSION", choice.asked.sessions,
                "directory with master.mcap, slave.mcap, netem.mcap, mcu.mcap; or a scene to run in virtual time, with "
                "settings of its own as SCENE,field.path=value,...",
                Needed::kYes);
  command.flag("--lab", choice.asked.lab, "also run the scene of each directory, as recorded, in virtual time");
  command.texts("--set", choice.asked.sets, "field.path=value, on top of every scene given; may be repeated");
  command.seed("--seed", choice.asked.seed, "seed of every random choice, instead of that of each scene given");
  command.output("--report", choice.report, "the comparison as one HTML file (- is standard output)");
  command.output("--json", choice.json, "all metrics and the differences as JSON (- is standard output)");
  return command;
}

int run_compare(const CompareChoice& choice) {
  const std::vector<ComparedSession> sessions = compared_sessions(choice.asked);
  write_to(choice.json, [&](std::ostream& out) { out << comparison_json(sessions); });
  write_to(choice.report, [&](std::ostream& out) { out << comparison_html(sessions); });
  (choice.json == "-" || choice.report == "-" ? std::cerr : std::cout) << comparison_text(sessions);
  return kExitOk;
}

}  // namespace farhand
