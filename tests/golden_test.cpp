// The numbers of four scenes, as another build type of the same source computed them: optimisation, sanitizers and
// assertions must not change what a run says.
//
// Builds on one machine agree in every byte. Between machines the library's sine differs in its last bit (it picks its
// code by the processor), so what is promised is one unit in the sixth digit of the summary, and 1e-9 in the table.
//
// After a change that is meant to change numbers: run golden_test of the asan build with
// FARHAND_GOLDEN_DIR=tests/golden and look at the difference before it is committed.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "common/judge/metrics.hpp"
#include "common/judge/summary.hpp"
#include "netem/lab/simulation.hpp"

namespace farhand {
namespace {

struct Numbers {
  std::string json, csv;
};

Numbers numbers_of(const std::string& scene) {
  const LoadedScene loaded = load_scene(scene);
  const Session session = simulate(loaded);
  std::ostringstream csv;
  write_csv(session, csv);
  return {summary_json(compute_metrics(session, loaded.scene), false), csv.str()};
}

// Every 5001st row of the table, the two sides in turn: where in time and on which side two builds part.
std::string excerpt(const std::string& csv) {
  std::istringstream in(csv);
  std::ostringstream out;
  std::string line;
  for (int k = 0; std::getline(in, line); ++k) {
    if (k == 0 || k % 5001 == 1) out << line << '\n';
  }
  return out.str();
}

// The columns that stood first when a file was made; what has come since stands behind them.
std::string first_columns(const std::string& csv, const std::string& of_file) {
  const auto header = std::string_view(of_file).substr(0, of_file.find('\n'));
  const auto columns = std::count(header.begin(), header.end(), ',') + 1;
  std::istringstream in(csv);
  std::ostringstream out;
  for (std::string line; std::getline(in, line);) {
    std::size_t end = 0;
    for (auto k = columns; k > 0 && end != std::string::npos; --k) end = line.find(',', end + (k < columns ? 1 : 0));
    out << line.substr(0, end) << '\n';
  }
  return out.str();
}

// Keys as they are now, wherever they stand.
std::string renamed(std::string json) {
  for (const MetricInfo& metric : kMetrics) {
    if (metric.formerly.empty()) continue;
    for (std::size_t at = 0; (at = json.find('"' + std::string(metric.formerly), at)) != std::string::npos; ++at)
      json.replace(at + 1, metric.formerly.size(), metric.key);
  }
  return json;
}

// The lines without the metrics that have come since a file was made, and without the commas, of which the last line of
// a list has none.
std::string metrics_of_file(const std::string& json, const std::string& of_file) {
  std::istringstream in(json);
  std::ostringstream out;
  for (std::string line; std::getline(in, line);) {
    const std::size_t from = line.find('"') + 1, to = line.find_first_of("\":", from);
    const std::string key = from > 0 && to != std::string::npos ? line.substr(from, to - from) : "";
    const bool is_new = std::ranges::find(kMetrics, key, &MetricInfo::key) != kMetrics.end() &&
                        of_file.find('"' + key + '"') == std::string::npos;
    if (line.ends_with(',')) line.pop_back();
    if (!is_new) out << line << '\n';
  }
  return out.str();
}

// Text that must be equal, but for numbers, which may differ by `relative` of themselves or by `absolute`.
void expect_close(const std::string& now, const std::string& then, double relative, double absolute) {
  std::istringstream a(now), b(then);
  std::string x, y;
  for (int row = 1; std::getline(a, x) && std::getline(b, y); ++row) {
    const char *p = x.c_str(), *q = y.c_str();
    while (*p != '\0' && *q != '\0') {
      char *p_end = nullptr, *q_end = nullptr;
      const double u = std::strtod(p, &p_end), v = std::strtod(q, &q_end);
      if (p_end != p && q_end != q) {
        EXPECT_LE(std::abs(u - v), std::max(relative * std::abs(v), absolute)) << "row " << row << ": " << x;
        p = p_end;
        q = q_end;
      } else if (*p++ != *q++) {
        break;
      }
    }
    EXPECT_TRUE(*p == '\0' && *q == '\0') << "row " << row << ": " << x << "\ninstead of " << y;
  }
  EXPECT_EQ(std::count(now.begin(), now.end(), '\n'), std::count(then.begin(), then.end(), '\n'));
}

std::string read(const std::string& path) {
  std::ifstream in(path);
  std::ostringstream out;
  out << in.rdbuf();
  return out.str();
}

class Golden : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(, Golden, testing::Values("four_channel", "four_channel_cdob_sdcv", "sea_friction", "demo"),
                         [](const auto& scene) { return std::string(scene.param); });

TEST_P(Golden, EveryBuildComputesTheSameNumbers) {
  const Numbers now = numbers_of(GetParam());
  if (const char* directory = std::getenv("FARHAND_GOLDEN_DIR")) {
    std::ofstream(std::string(directory) + "/" + GetParam() + ".json") << now.json;
    std::ofstream(std::string(directory) + "/" + GetParam() + ".csv") << excerpt(now.csv);
    GTEST_SKIP() << "golden files written";
  }
  std::string base = FARHAND_GOLDEN;
  base.append("/").append(GetParam());
  const std::string json = renamed(read(base + ".json"));
  expect_close(metrics_of_file(now.json, json), metrics_of_file(json, json), 1.0001e-5, 1e-12);
  const std::string then = read(base + ".csv");
  expect_close(first_columns(excerpt(now.csv), then), then, 0.0, 1e-9);
}

}  // namespace
}  // namespace farhand
