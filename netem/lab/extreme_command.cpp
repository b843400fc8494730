#include "netem/lab/extreme_command.hpp"

#include <chrono>
#include <iomanip>
#include <iostream>
#include <thread>

#include "common/runtime/program.hpp"
#include "netem/lab/extreme.hpp"
#include "netem/lab/extreme_report.hpp"
#include "netem/lab/write_to.hpp"

namespace farhand {
Command add_extreme(Command program, ExtremeChoice& choice) {
  Command command = program.subcommand(
      "extreme", "run the catalogue of stiff and extreme cases; exit code 3 if one comes out otherwise than expected");
  command.text("--family", choice.family, "only families whose name contains this");
  command.count("--threads", choice.threads, 0, 1024, "0: one per core; the results are the same for any number");
  command.output("--json", choice.json, "results as JSON (- is standard output)");
  command.output("--csv", choice.csv, "results as a table (- is standard output)");
  command.output("--report", choice.report, "results as one HTML file (- is standard output)");
  return command;
}

int run_extreme(const ExtremeChoice& choice) {
  std::vector<extreme::Case> cases = extreme::catalogue();
  std::erase_if(cases, [&](const extreme::Case& c) { return c.family.find(choice.family) == std::string::npos; });
  if (cases.empty()) throw std::invalid_argument("no family contains '" + choice.family + "'");
  const int threads = choice.threads > 0 ? choice.threads : static_cast<int>(std::thread::hardware_concurrency());
  const auto start = std::chrono::steady_clock::now();
  const std::vector<extreme::Result> results = extreme::run(cases, std::max(threads, 1));
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();

  const bool stdout_taken = choice.json == "-" || choice.csv == "-" || choice.report == "-";
  std::ostream& out = stdout_taken ? std::cerr : std::cout;
  std::size_t wrong = 0;
  for (const extreme::Result& r : results) {
    out << (r.complaint.empty() ? "  as expected  " : "  OTHERWISE    ") << std::left << std::setw(9)
        << extreme::name_of(r.of->expected.verdict) << std::setw(11) << std::setprecision(3) << r.outcome.error
        << std::right << r.of->family << ": " << r.of->name << '\n';
    if (!r.complaint.empty()) out << "      " << r.complaint << "\n      " << r.outcome.what << '\n';
    wrong += !r.complaint.empty();
  }
  const auto slowest = std::ranges::max_element(results, {}, &extreme::Result::wall_s);
  out << extreme::summary_text(results) << "  longest: " << slowest->of->family << ", " << slowest->of->name << ", "
      << std::setprecision(3) << slowest->wall_s << " s\n"
      << "  " << std::setprecision(3) << wall_s << " s on " << threads << " threads\n";
  write_to(choice.json, [&](std::ostream& to) { to << extreme::json_of(results); });
  write_to(choice.csv, [&](std::ostream& to) { to << extreme::csv_of(results); });
  write_to(choice.report, [&](std::ostream& to) { to << extreme::html_of(results); });
  return wrong == 0 ? kExitOk : kExitVerdictFailed;
}

}  // namespace farhand
