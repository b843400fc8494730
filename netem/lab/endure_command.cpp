#include "netem/lab/endure_command.hpp"

#include <cstdio>

#include "common/config/json.hpp"
#include "netem/lab/endure.hpp"
#include "netem/lab/write_to.hpp"

namespace farhand {
namespace {

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

}  // namespace

Command add_endure(Command program, EndureChoice& choice) {
  Command command = program.subcommand(
      "endure", "repeat the session of a scene for hours of virtual time: error, energy and memory of each hour");
  add_scene_argument(command, choice.scene);
  command.number("--hours", choice.hours, 1e-4, 1000.0, "virtual time, h; by default 24");
  command.number("--line", choice.line_s, 0.1, 1e6, "virtual time of a line, s; by default 3600");
  command.output("--json", choice.json, "the lines as JSON (- is standard output)");
  return command;
}

int endure_scene(const EndureChoice& choice) {
  const LoadedScene loaded = repeated(choice.scene.load(), choice.hours * 3600.0);
  std::FILE* out = choice.json == "-" ? stderr : stdout;
  Json lines = Json::array();
  double wall_s = 0;
  endure(loaded, choice.line_s, [&](const Stretch& stretch) {
    if (wall_s == 0) print_head(out);
    print_row(out, stretch);
    if (!choice.json.empty()) lines.push_back(json_of(stretch));
    wall_s += stretch.wall_s;
  });
  std::fprintf(out, "%.0f s in %.1f s, %.0f times real time\n", loaded.scene.duration_s(), wall_s,
               loaded.scene.duration_s() / wall_s);
  const Json all = Json::object({{"scene", loaded.name}, {"seed", loaded.scene.seed()}, {"lines", lines}});
  write_to(choice.json, [&](std::ostream& to) { to << all.dump(2) << '\n'; });
  return kExitOk;
}

}  // namespace farhand
