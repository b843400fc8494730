// Sessions in virtual time.
#include <chrono>
#include <cstdio>
#include <iomanip>
#include <iostream>
#include <memory>

#include "common/config/json.hpp"
#include "common/runtime/program.hpp"
#include "netem/lab/commands.hpp"
#include "netem/lab/compare_report.hpp"
#include "netem/lab/endure.hpp"
#include "netem/lab/explain_text.hpp"
#include "netem/lab/session_outputs.hpp"
#include "netem/lab/simulation.hpp"
#include "netem/lab/workload.hpp"
#include "netem/lab/write_to.hpp"

namespace farhand {
namespace {

struct RunChoice {
  SceneChoice scene;
  SessionOutputs to;
};

int run_scene(const RunChoice& choice) {
  const SessionOutputs& to = choice.to;
  const LoadedScene loaded = choice.scene.load();
  const auto start = std::chrono::steady_clock::now();
  const Session session = simulate(loaded);
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const Metrics metrics = compute_metrics(session, loaded.scene);
  write_outputs(to, session, loaded.scene, metrics);

  std::ostream& out = to.standard_output() ? std::cerr : std::cout;
  print_table(session, metrics, out);
  out << "  " << loaded.scene.duration_s() << " s in " << std::setprecision(3) << wall_s << " s, "
      << loaded.scene.duration_s() / wall_s << " times real time\n";
  return verdict_code(metrics);
}

struct CompareChoice {
  ComparisonAsked asked;
  std::string json, report;
};

int run_compare(const CompareChoice& choice) {
  const std::vector<ComparedSession> sessions = compared_sessions(choice.asked);
  write_to(choice.json, [&](std::ostream& out) { out << comparison_json(sessions); });
  write_to(choice.report, [&](std::ostream& out) { out << comparison_html(sessions); });
  (choice.json == "-" || choice.report == "-" ? std::cerr : std::cout) << comparison_text(sessions);
  return kExitOk;
}

struct EndureChoice {
  SceneChoice scene;
  double hours = 24, line_s = 3600;
  std::string json;
};

Json json_of(const Stretch& s) {
  return Json::object({{"until_s", s.until_s},
                       {"engaged_s", s.engaged_s},
                       {"tracking_rms_rad", s.tracking_rms_rad},
                       {"tracking_peak_rad", s.tracking_peak_rad},
                       {"force_error_rms_nm", s.force_error_rms_nm},
                       {"force_error_peak_nm", s.force_error_peak_nm},
                       {"energy_residual_master_j", s.energy_residual_master_j},
                       {"energy_residual_slave_j", s.energy_residual_slave_j},
                       {"energy_exchanged_j", s.energy_exchanged_j},
                       {"playout_mean_s", s.playout_mean_s},
                       {"lost", s.lost},
                       {"late", s.late},
                       {"wall_clock", Json::object({{"wall_s", s.wall_s}, {"resident_bytes", s.resident_bytes}})}});
}

void print_row(std::FILE* out, const Stretch& s) {
  std::fprintf(out, "%9.0f %9.1f %9.4f %9.4f %9.5f %9.5f %10.2e %10.2e %9.3f %8.2f %8llu %7llu %9.2f %7.1f\n",
               s.until_s, s.engaged_s, 1e3 * s.tracking_rms_rad, 1e3 * s.tracking_peak_rad, s.force_error_rms_nm,
               s.force_error_peak_nm, s.energy_residual_master_j, s.energy_residual_slave_j, s.energy_exchanged_j,
               1e3 * s.playout_mean_s, static_cast<unsigned long long>(s.lost), static_cast<unsigned long long>(s.late),
               static_cast<double>(s.resident_bytes) / 1048576.0, s.wall_s);
  std::fflush(out);
}

void print_head(std::FILE* out) {
  std::fprintf(out, "%9s %9s %9s %9s %9s %9s %10s %10s %9s %8s %8s %7s %9s %7s\n", "until", "engaged", "tracking",
               "peak", "force", "peak", "residual", "residual", "exchanged", "playout", "lost", "late", "memory",
               "wall");
  std::fprintf(out, "%9s %9s %9s %9s %9s %9s %10s %10s %9s %8s %8s %7s %9s %7s\n", "s", "s", "rms mrad", "mrad",
               "rms N m", "N m", "master J", "slave J", "J", "mean ms", "", "", "MiB", "s");
}

int endure_scene(const EndureChoice& choice) {
  const LoadedScene loaded = repeated(choice.scene.load(), choice.hours * 3600.0);
  std::FILE* out = choice.json == "-" ? stderr : stdout;
  Json lines = Json::array();
  double wall_s = 0;
  double virtual_s = 0;
  int code = kExitOk;
  const Workload work(1, "virtual seconds");
  const auto tell = [&](const Stretch& stretch) {
    work.wipe();
    if (wall_s == 0) print_head(out);
    print_row(out, stretch);
    if (!choice.json.empty()) lines.push_back(json_of(stretch));
    wall_s += stretch.wall_s;
    virtual_s = stretch.until_s;
  };
  try {
    endure(loaded, choice.line_s, tell, work);
  } catch (const Stopped& stopped) {
    std::fprintf(stderr, "farhand-lab: stopped after %zu of %zu %s; the lines above are complete\n", stopped.done,
                 stopped.total, stopped.what.c_str());
    code = kExitStopped;
  }
  std::fprintf(out, "%.0f s in %.1f s, %.0f times real time\n", virtual_s, wall_s,
               wall_s > 0 ? virtual_s / wall_s : 0.0);
  const Json all = Json::object({{"scene", loaded.name}, {"seed", loaded.scene.seed()}, {"lines", lines}});
  write_to(choice.json, [&](std::ostream& to) { to << all.dump(2) << '\n'; });
  return code;
}

struct ExplainChoice {
  SceneChoice scene;
  std::string json;
};

}  // namespace

Action add_run(Command command) {
  const auto choice = std::make_shared<RunChoice>();
  SessionOutputs& to = choice->to;
  add_scene_argument(command, choice->scene);
  command.output("--json", to.json, "metrics as flat JSON (- is standard output)");
  command.output("--csv", to.csv, "every tick of both sides (- is standard output)");
  command.output("--report", to.report, "report as one HTML file (- is standard output)");
  command.output("--record", to.record, "recording of both sides and the link as MCAP (- is standard output)");
  return [choice] { return run_scene(*choice); };
}

Action add_compare(Command command) {
  const auto choice = std::make_shared<CompareChoice>();
  ComparisonAsked& asked = choice->asked;
  command.texts("SESSION", asked.sessions,
                "directory with master.mcap, slave.mcap, netem.mcap, mcu.mcap; or a scene to run in virtual time, with "
                "settings of its own as SCENE,field.path=value,...",
                Needed::kYes);
  command.flag("--lab", asked.lab, "also run the scene of each directory, as recorded, in virtual time");
  command.texts("--set", asked.sets, "field.path=value, on top of every scene given; may be repeated");
  command.seed("--seed", asked.seed, "seed of every random choice, instead of that of each scene given");
  command.output("--report", choice->report, "the comparison as one HTML file (- is standard output)");
  command.output("--json", choice->json, "all metrics and the differences as JSON (- is standard output)");
  return [choice] { return run_compare(*choice); };
}

Action add_endure(Command command) {
  const auto choice = std::make_shared<EndureChoice>();
  add_scene_argument(command, choice->scene);
  command.number("--hours", choice->hours, 1e-4, 1000.0, "virtual time, h; by default 24");
  command.number("--line", choice->line_s, 0.1, 1e6, "virtual time of a line, s; by default 3600");
  command.output("--json", choice->json, "the lines as JSON (- is standard output)");
  return [choice] { return endure_scene(*choice); };
}

Action add_explain(Command command) {
  const auto choice = std::make_shared<ExplainChoice>();
  add_scene_argument(command, choice->scene);
  command.output("--json", choice->json,
                 "the same as JSON; what the wall clock measured stands under wall_clock (- is standard output)");
  return [choice] {
    const Explanation explanation = explain(choice->scene.load());
    if (choice->json != "-") print_explanation(explanation, std::cout);
    write_to(choice->json, [&](std::ostream& to) { to << json_text(explanation) << '\n'; });
    return kExitOk;
  };
}

}  // namespace farhand
