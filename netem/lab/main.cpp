// farhand-lab: experiments in virtual time, and what one does to scenes and recordings at a desk.
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <iomanip>

#include "common/config/schema.hpp"
#include "common/record/export.hpp"
#include "common/record/mcap_reader.hpp"
#include "common/record/merge.hpp"
#include "common/record/metrics.hpp"
#include "common/record/report.hpp"
#include "common/record/summary.hpp"
#include "common/runtime/program.hpp"
#include "netem/lab/compare_command.hpp"
#include "netem/lab/endure_command.hpp"
#include "netem/lab/explain_command.hpp"
#include "netem/lab/extreme_command.hpp"
#include "netem/lab/faults_command.hpp"
#include "netem/lab/identify_command.hpp"
#include "netem/lab/limits_command.hpp"
#include "netem/lab/precision_command.hpp"
#include "netem/lab/rogue_command.hpp"
#include "netem/lab/simulation.hpp"
#include "netem/lab/sweep_command.hpp"
#include "netem/lab/write_to.hpp"
#include "slave/emulator_params.hpp"

namespace farhand {
namespace {

namespace fs = std::filesystem;

struct Outputs {
  std::string json, csv, report, record;
};

void write_outputs(const Outputs& to, const Session& session, const scene::Scene& scene, const Metrics& metrics) {
  write_to(to.json, [&](std::ostream& out) { out << summary_json(metrics, !session.deterministic); });
  write_to(to.csv, [&](std::ostream& out) { write_csv(session, out); });
  write_to(to.report, [&](std::ostream& out) { out << report_html(session, scene, metrics); });
  if (to.record == "-") {  // a recording is completed by renaming it, so it takes a detour to standard output
    const fs::path file =
        write_session_mcap(session, fs::temp_directory_path() / ("farhand-" + std::to_string(::getpid()) + ".mcap"));
    write_to("-", [&](std::ostream& out) { out << std::ifstream(file, std::ios::binary).rdbuf(); });
    fs::remove(file);
  } else if (!to.record.empty()) {
    const fs::path file = write_session_mcap(session, to.record);
    if (file != to.record) std::cerr << to.record << " exists already and stays as it is: " << file.string() << '\n';
  }
}

void print_table(const Session& session, const Metrics& metrics, std::ostream& out) {
  for (const SessionEvent& event : session.events) {
    out << std::setw(10) << std::fixed << std::setprecision(3) << event.t_s << " s  " << std::left << std::setw(7)
        << event.who << std::right << event.text << '\n';
  }
  out << std::defaultfloat << std::setprecision(4);
  for (const Metric& metric : metrics.all()) {
    if (std::holds_alternative<std::monostate>(metric.value) || metric.info->key == "reasons" ||
        metric.info->key == "absent")
      continue;
    out << "  " << std::left << std::setw(28) << metric.info->key << std::right;
    if (std::holds_alternative<double>(metric.value)) {
      out << metrics.number(metric.info->key) << ' ' << (metric.info->unit == "1" ? "" : metric.info->unit);
    } else if (std::holds_alternative<bool>(metric.value)) {
      out << (metrics.is_true(metric.info->key) ? "yes" : "no");
    } else if (std::holds_alternative<std::uint64_t>(metric.value)) {
      out << std::get<std::uint64_t>(metric.value);
    } else {
      out << metrics.text(metric.info->key);
    }
    out << '\n';
  }
  for (const std::string& reason : metrics.list("reasons")) out << "  because " << reason << '\n';
}

int verdict_code(const Metrics& metrics) { return metrics.text("verdict") == "failed" ? kExitVerdictFailed : kExitOk; }

int run_scene(const SceneChoice& choice, const Outputs& to) {
  const LoadedScene loaded = choice.load();
  const auto start = std::chrono::steady_clock::now();
  const Session session = simulate(loaded);
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const Metrics metrics = compute_metrics(session, loaded.scene);
  write_outputs(to, session, loaded.scene, metrics);

  const bool stdout_taken = to.json == "-" || to.csv == "-" || to.report == "-" || to.record == "-";
  std::ostream& out = stdout_taken ? std::cerr : std::cout;
  print_table(session, metrics, out);
  out << "  " << loaded.scene.duration_s() << " s in " << std::setprecision(3) << wall_s << " s, "
      << loaded.scene.duration_s() / wall_s << " times real time\n";
  return verdict_code(metrics);
}

int check(const std::vector<std::string>& files) {
  int code = kExitOk;
  for (const std::string& file : files) {
    try {
      const LoadedScene loaded = load_scene(file);
      if (loaded.scene.slave().device() == scene::SERIES_ELASTIC) emulator_params(loaded.scene);
      for (const std::string& warning : loaded.warnings) std::cerr << loaded.path << ": warning: " << warning << '\n';
      std::cout << loaded.path << ": ok"
                << (loaded.warnings.empty() ? "" : ", " + std::to_string(loaded.warnings.size()) + " to think about")
                << '\n';
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

void print_metrics_table() {
  std::cout << "\nMetrics\n\n";
  for (const MetricInfo& metric : kMetrics) {
    std::cout << "  " << std::left << std::setw(28) << metric.key << std::setw(12) << metric.unit << std::right
              << metric.meaning << (metric.deterministic ? "" : " (wall clock)") << '\n';
  }
}

int schema(bool json) {
  if (json) {
    print_schema_json(std::cout);
  } else {
    print_schema(std::cout);
    print_metrics_table();
  }
  return kExitOk;
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

int main(int argc, char** argv) {
  Program program("farhand-lab", "Experiments in virtual time; scenes, recordings and reports.");
  Command lab = program.command();
  lab.require_subcommand();
  SceneChoice choice;
  Outputs outputs;
  Command run = lab.subcommand("run", "run a scene in virtual time; exit code 3 if the verdict is failed");
  add_scene_argument(run, choice);
  run.output("--json", outputs.json, "metrics as flat JSON (- is standard output)");
  run.output("--csv", outputs.csv, "every tick of both sides (- is standard output)");
  run.output("--report", outputs.report, "report as one HTML file (- is standard output)");
  run.output("--record", outputs.record, "recording of both sides and the link as MCAP (- is standard output)");

  std::vector<std::string> files;
  Command checked = lab.subcommand("check", "say everything that is wrong with scene files");
  checked.texts("FILE", files, "scene files or names", Needed::kYes);

  LimitsChoice limits_choice;
  const Command limits = add_limits(lab, limits_choice);

  bool json = false;
  Command printed = lab.subcommand("schema", "every setting with unit, range, default and meaning, and every metric");
  printed.flag("--json", json, "the settings as JSON");

  Command made =
      lab.subcommand("directory",
                     "make sessions/UTC-SCENE-SEED for the recordings of a session; prints it, the scene file "
                     "in it and the device of the slave");
  add_scene_argument(made, choice);

  std::string directory;
  Command reported = lab.subcommand("report", "merge the recordings of a session's processes and report");
  reported.text("DIR", directory, "directory with master.mcap, slave.mcap, netem.mcap, mcu.mcap", Needed::kYes);

  CompareChoice compare_choice;
  const Command compared = add_compare(lab, compare_choice);
  PrecisionChoice precision_choice;
  const Command precision = add_precision(lab, precision_choice);
  SweepChoice sweep_choice;
  const Command swept = add_sweep(lab, sweep_choice);

  std::string file, to, csv_directory, mat_file;
  Command recording = lab.subcommand("recording", "mend or export a recording");
  recording.require_subcommand();
  Command recovered = recording.subcommand("recover", "complete an unfinished recording");
  recovered.input("FILE", file, "unfinished recording (.mcap.part)", Needed::kYes);
  recovered.output("TO", to, "complete recording; by default FILE without .part");
  Command exported = recording.subcommand("export", "for other tools");
  exported.input("FILE", file, "recording", Needed::kYes);
  exported.output_directory("--csv", csv_directory, "directory for one CSV file per topic");
  exported.output("--mat", mat_file, "MAT file, level 4");

  EndureChoice endurance;
  const Command endured = add_endure(lab, endurance);
  ExplainChoice explanation;
  const Command explained = add_explain(lab, explanation);
  ExtremeChoice extreme_choice;
  const Command extreme = add_extreme(lab, extreme_choice);
  FaultsChoice faults_choice;
  const Command faults = add_faults(lab, faults_choice);
  RogueChoice rogue_choice;
  const Command rogue = add_rogue(lab, rogue_choice);
  IdentifyChoice identify_choice;
  const Command identified = add_identify(lab, identify_choice);

  return program.run(argc, argv, [&] {
    if (explained.given()) return explain_scene(explanation);
    if (endured.given()) return endure_scene(endurance);
    if (run.given()) return run_scene(choice, outputs);
    if (checked.given()) return check(files);
    if (limits.given()) return run_limits(limits_choice);
    if (printed.given()) return schema(json);
    if (precision.given()) return run_precision(precision_choice);
    if (swept.given()) return run_sweep(sweep_choice);
    if (made.given()) return make_directory(choice);
    if (reported.given()) return report(directory);
    if (compared.given()) return run_compare(compare_choice);
    if (extreme.given()) return run_extreme(extreme_choice);
    if (faults.given()) return run_faults(faults_choice);
    if (rogue.given()) return run_rogue(rogue_choice);
    if (identified.given()) return run_identify(identify_choice);
    return recovered.given() ? recover(file, to) : export_recording(file, csv_directory, mat_file);
  });
}

}  // namespace
}  // namespace farhand

int main(int argc, char** argv) { return farhand::main(argc, argv); }
