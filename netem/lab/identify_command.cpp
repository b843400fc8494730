#include "netem/lab/identify_command.hpp"

#include "common/runtime/program.hpp"
#include "netem/lab/identify.hpp"
#include "netem/lab/write_to.hpp"

namespace farhand {

Command add_identify(Command program, IdentifyChoice& choice) {
  Command command = program.subcommand("identify",
                                       "inertia, friction and spring of an axis from a recording in which it was moved "
                                       "without a hand in it; exit code 3 if it is another one than the scene says");
  command.input("FILE", choice.file, "recording", Needed::kYes);
  command.text("--side", choice.side, "master, slave or mcu (the orthosis); needed where FILE holds several");
  command.output("--json", choice.json, "results as JSON (- is standard output)");
  command.number("--inertia", choice.inertia_kgm2, 0, 10,
                 "known inertia of the axis, kg m2: tells the torque constant");
  command.input("--loaded", choice.loaded,
                "recording of the same axis with an inertia added: tells the torque constant");
  command.number("--added", choice.added_kgm2, 0, 10, "that inertia, kg m2");
  return command;
}

int run_identify(const IdentifyChoice& choice) {
  if (choice.loaded.empty() != (choice.added_kgm2 == 0.0))
    throw std::invalid_argument("--loaded and --added (above 0 kg m2) are given together");
  if (!choice.loaded.empty() && choice.inertia_kgm2 > 0.0)
    throw std::invalid_argument("give --inertia, or --loaded with --added, not both");
  KnownInertia known{.own_kgm2 = {}, .loaded = choice.loaded, .added_kgm2 = choice.added_kgm2};
  if (choice.inertia_kgm2 > 0.0) known.own_kgm2 = choice.inertia_kgm2;
  const Identified found = identify_recording(choice.file, choice.side, known);
  print_identified(found, choice.json == "-" ? std::cerr : std::cout);
  write_to(choice.json, [&](std::ostream& out) { out << json_of(found).dump(2) << '\n'; });
  return accepted(found) ? kExitOk : kExitVerdictFailed;
}

}  // namespace farhand
