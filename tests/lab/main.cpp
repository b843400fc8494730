// farhand-lab: experiments in virtual time, and everything one does to scenes and recordings at a desk.
#include <CLI/CLI.hpp>
#include <chrono>
#include <cstring>
#include <fstream>
#include <iostream>

#include "common/config/load.hpp"
#include "common/config/schema.hpp"
#include "common/record/metrics.hpp"
#include "common/record/summary.hpp"
#include "common/record/verdict.hpp"
#include "tests/lab/simulation.hpp"

namespace farhand {
namespace {

constexpr int kOk = 0, kFailedWhileRunning = 1, kUsage = 2, kVerdictFailed = 3;

struct RunOptions {
  std::string scene;
  std::vector<std::string> sets;
  std::optional<std::uint64_t> seed;
  std::string json, csv, report, record;
};

// "-" is standard output. Throws when the file cannot be written to its end.
template <class Write>
void write_to(const std::string& path, Write&& write) {
  if (path.empty()) return;
  if (path == "-") {
    write(std::cout);
    std::cout.flush();
    return;
  }
  std::ofstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error("cannot write " + path + ": " + std::strerror(errno));
  write(file);
  file.close();
  if (!file) throw std::runtime_error("could not write all of " + path + ": " + std::strerror(errno));
}

int run(const RunOptions& options) {
  const LoadedScene loaded = load_scene(options.scene, options.sets, options.seed);
  const auto start = std::chrono::steady_clock::now();
  const Session session = simulate(loaded);
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const Metrics metrics = compute_metrics(session, loaded.scene);

  write_to(options.json, [&](std::ostream& out) { out << summary_json(metrics, false); });
  write_to(options.csv, [&](std::ostream& out) { write_csv(session, out); });
  const bool stdout_taken = options.json == "-" || options.csv == "-" || options.report == "-";
  std::ostream& out = stdout_taken ? std::cerr : std::cout;
  out << summary_json(metrics, false);
  for (const SessionEvent& e : session.events) out << e.t_s << " " << e.who << " " << e.text << "\n";
  out << "wall time " << wall_s << " s for " << loaded.scene.duration_s() << " s\n";
  return metrics.text("verdict") == "failed" ? kVerdictFailed : kOk;
}

[[maybe_unused]] int check(const std::vector<std::string>& files) {
  int code = kOk;
  for (const std::string& file : files) {
    try {
      const LoadedScene loaded = load_scene(file);
      std::cout << loaded.path << ": ok\n";
    } catch (const ConfigError& error) {
      std::cerr << error.what() << '\n';
      code = kUsage;
    }
  }
  return code;
}

}  // namespace
}  // namespace farhand

int main(int argc, char** argv) {
  farhand::RunOptions o;
  o.scene = argv[1];
  for (int i = 2; i < argc; ++i) {
    std::string a = argv[i];
    if (a.starts_with("csv:"))
      o.csv = a.substr(4);
    else
      o.sets.push_back(a);
  }
  try {
    return farhand::run(o);
  } catch (const std::exception& e) {
    std::cerr << e.what() << "\n";
    return 2;
  }
}
