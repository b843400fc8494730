// What one does to scenes and recordings at a desk.
#include <chrono>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <memory>

#include "common/advice/warnings.hpp"
#include "common/config/schema.hpp"
#include "common/judge/metrics.hpp"
#include "common/law/architectures.hpp"
#include "common/record/columns.hpp"
#include "common/record/export.hpp"
#include "common/record/mcap_reader.hpp"
#include "common/record/merge.hpp"
#include "common/runtime/program.hpp"
#include "netem/lab/commands.hpp"
#include "netem/lab/identify.hpp"
#include "netem/lab/session_outputs.hpp"
#include "netem/lab/write_to.hpp"
#include "slave/emulator_params.hpp"

namespace farhand {
namespace {

namespace fs = std::filesystem;

int check(const std::vector<std::string>& files) {
  int code = kExitOk;
  for (const std::string& file : files) {
    try {
      const LoadedScene loaded = load_scene(file);
      if (loaded.scene.slave().device() == scene::SERIES_ELASTIC) emulator_params(loaded.scene);
      const std::vector<std::string> warned = warnings(loaded.scene);
      for (const std::string& warning : warned) std::cerr << loaded.path << ": warning: " << warning << '\n';
      std::cout << loaded.path << ": ok"
                << (warned.empty() ? "" : ", " + std::to_string(warned.size()) + " to think about") << '\n';
    } catch (const ConfigError& error) {
      std::cerr << error.what() << '\n';
      code = kExitUsage;
    } catch (const std::invalid_argument& error) {
      std::cerr << file << ": " << error.what() << '\n';
      code = kExitUsage;
    }
  }
  return code;
}

void print_column(std::string_view name, std::string_view unit, std::string_view meaning) {
  std::cout << "  " << std::left << std::setw(28) << name << std::setw(12) << unit << std::right << meaning << '\n';
}

void print_columns_table() {
  std::cout << "\nColumns of a recording, for each tick of a station\n\n";
  for (const auto& column : kStationColumns) print_column(column.name, column.unit, column.meaning);
  for (const Architecture& laws : architectures()) {
    for (const auto& [side, signals] : {std::pair{"master", laws.master.signals}, {"slave", laws.slave.signals}}) {
      if (!signals.empty()) std::cout << "\n  " << laws.name << ", " << side << '\n';
      for (const LawSignal& signal : signals) print_column(signal.name, signal.unit, signal.meaning);
    }
  }
}

void print_metrics_table() {
  std::cout << "\nMetrics\n\n";
  for (const MetricInfo& metric : kMetrics) {
    print_column(metric.key, metric.unit,
                 std::string(metric.meaning) + (metric.deterministic ? "" : " (wall clock)") +
                     (metric.formerly.empty() ? "" : "; formerly " + std::string(metric.formerly)));
  }
}

// A directory of its own for the recordings of one session, with the whole scene in it, so that its processes cannot
// disagree.
int make_directory(const SceneChoice& choice) {
  const LoadedScene loaded = choice.load();
  const auto utc = std::chrono::system_clock::now().time_since_epoch();
  const fs::path directory = session_directory(
      "sessions", std::chrono::duration_cast<std::chrono::nanoseconds>(utc).count(), loaded.name, loaded.scene.seed());
  const std::string scene_file = (directory / (loaded.name + ".txtpb")).string();
  write_to(scene_file, [&](std::ostream& out) { out << complete_text(loaded.scene); });
  std::cout << directory.string() << ' ' << scene_file << ' ' << scene::Device_Name(loaded.scene.slave().device())
            << '\n';
  return kExitOk;
}

int report(const std::string& directory) {
  const Session session = merge_recordings(directory);
  const scene::Scene scene = load_scene_text(session.scene_text, directory + "/scene.txtpb").scene;
  const Metrics metrics = compute_metrics(session, scene);
  const fs::path root(directory);
  std::vector<fs::path> files{root / "summary.json", root / "report.html", root / "session.mcap"};
  const int number = free_number(files);  // of a report made again, one for all three
  for (fs::path& file : files) file = numbered(file, number);
  write_outputs({files[0].string(), "", files[1].string(), files[2].string()}, session, scene, metrics);
  print_table(session, metrics, std::cout);
  std::cout << "  clocks: slave + " << session.clock_offset_s << " s = master, within +-"
            << session.clock_offset_bound_s << " s\n";
  std::cout << files[1].string() << '\n' << directory << '\n';
  return verdict_code(metrics);
}

int recover(const std::string& from, std::string to) {
  if (to.empty()) {
    to = from.ends_with(".part") ? from.substr(0, from.size() - 5) : from + ".recovered.mcap";
  }
  const McapFindings findings = recover_mcap(from, to);
  for (const std::string& problem : findings.problems) std::cerr << problem << '\n';
  std::cout << findings.messages << " messages in " << findings.chunks << " chunks recovered\n" << to << '\n';
  return kExitOk;
}

int export_recording(const std::string& file, const std::string& csv_directory, const std::string& mat_file) {
  if (csv_directory.empty() && mat_file.empty()) throw std::invalid_argument("give --csv DIR, --mat FILE or both");
  const auto tell = [](const Exported& exported) {
    for (const std::string& problem : exported.problems) std::cerr << problem << '\n';
    for (const fs::path& written : exported.files) std::cout << written.string() << '\n';
  };
  if (!csv_directory.empty()) tell(export_csv(file, csv_directory));
  if (!mat_file.empty()) tell(export_mat(file, mat_file));
  return kExitOk;
}

struct RecordingChoice {
  std::string file, to, csv_directory, mat_file;
};

struct IdentifyChoice {
  std::string file, side, json, loaded;
  double inertia_kgm2 = 0.0, added_kgm2 = 0.0;
};

int identify(const IdentifyChoice& choice) {
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

}  // namespace

Action add_check(Command command) {
  const auto files = std::make_shared<std::vector<std::string>>();
  command.texts("FILE", *files, "scene files or names", Needed::kYes);
  return [files] { return check(*files); };
}

Action add_schema(Command command) {
  const auto json = std::make_shared<bool>(false);
  command.flag("--json", *json, "the settings as JSON");
  return [json] {
    if (*json) {
      print_schema_json(std::cout);
    } else {
      print_schema(std::cout);
      print_metrics_table();
      print_columns_table();
    }
    return kExitOk;
  };
}

Action add_directory(Command command) {
  const auto choice = std::make_shared<SceneChoice>();
  add_scene_argument(command, *choice);
  return [choice] { return make_directory(*choice); };
}

Action add_report(Command command) {
  const auto directory = std::make_shared<std::string>();
  command.text("DIR", *directory, "directory with master.mcap, slave.mcap, netem.mcap, mcu.mcap", Needed::kYes);
  return [directory] { return report(*directory); };
}

Action add_recording(Command command) {
  const auto choice = std::make_shared<RecordingChoice>();
  command.require_subcommand();
  Command recovered = command.subcommand("recover", "complete an unfinished recording");
  recovered.input("FILE", choice->file, "unfinished recording (.mcap.part)", Needed::kYes);
  recovered.output("TO", choice->to, "complete recording; by default FILE without .part");
  Command exported = command.subcommand("export", "for other tools");
  exported.input("FILE", choice->file, "recording", Needed::kYes);
  exported.output_directory("--csv", choice->csv_directory, "directory for one CSV file per topic");
  exported.output("--mat", choice->mat_file, "MAT file, level 4");
  return [choice, recovered] {
    if (recovered.given()) return recover(choice->file, choice->to);
    return export_recording(choice->file, choice->csv_directory, choice->mat_file);
  };
}

Action add_identify(Command command) {
  const auto choice = std::make_shared<IdentifyChoice>();
  command.input("FILE", choice->file, "recording", Needed::kYes);
  command.text("--side", choice->side, "master, slave or mcu (the orthosis); needed where FILE holds several");
  command.output("--json", choice->json, "results as JSON (- is standard output)");
  command.number("--inertia", choice->inertia_kgm2, 0, 10,
                 "known inertia of the axis, kg m2: tells the torque constant");
  command.input("--loaded", choice->loaded,
                "recording of the same axis with an inertia added: tells the torque constant");
  command.number("--added", choice->added_kgm2, 0, 10, "that inertia, kg m2");
  return [choice] { return identify(*choice); };
}

}  // namespace farhand
