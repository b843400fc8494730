#include "netem/lab/session_outputs.hpp"

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iomanip>
#include <iostream>

#include "common/judge/summary.hpp"
#include "common/record/session_file.hpp"
#include "common/runtime/command.hpp"
#include "common/show/report.hpp"
#include "netem/lab/write_to.hpp"

namespace farhand {

namespace fs = std::filesystem;

void write_outputs(const SessionOutputs& to, const Session& session, const scene::Scene& scene,
                   const Metrics& metrics) {
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

}  // namespace farhand
