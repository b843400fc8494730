// A session as one line of a golden file: its metrics to the last digit, which limits acted, and a digest of every row.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include "common/judge/metrics.hpp"
#include "netem/lab/simulation.hpp"

namespace farhand {

struct OrdinarySession {
  std::string name;
  std::function<LoadedScene()> load;
};

inline std::string every_digit(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.17g", value);
  return text;
}

// FNV-1a over the bits of whatever is given to it.
class Digest {
 public:
  void add(std::uint64_t bits) {
    for (int k = 0; k < 8; ++k) hash_ = (hash_ ^ (bits >> (8 * k) & 0xff)) * 0x100000001b3ull;
  }
  void add(double value) { add(std::bit_cast<std::uint64_t>(value == 0.0 ? 0.0 : value)); }  // -0 is 0
  std::string text() const {
    char text[24];
    std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(hash_));
    return text;
  }

 private:
  std::uint64_t hash_ = 0xcbf29ce484222325ull;
};

// The library picks its sine by the processor, and its last bit with it.
inline std::string digest_of_mathematics() {
  Digest digest;
  for (int k = 1; k < 4000; ++k) {
    const double x = 0.0137 * k;
    for (const double y : {std::sin(x), std::cos(x), std::exp(-x), std::log(x), std::pow(x, 0.3)}) digest.add(y);
  }
  return digest.text();
}

inline std::uint32_t limits_ever(const std::vector<StationSample>& rows) {
  std::uint32_t ever = 0;
  for (const StationSample& row : rows) ever |= row.limits;
  return ever;
}

inline double first_engaged_s(const std::vector<StationSample>& rows) {
  for (const StationSample& row : rows) {
    if (row.state == static_cast<int>(StationState::kEngaged)) return row.t_s;
  }
  return kAbsent;
}

// Largest over 1 ms of what the device gives to the person, by the world's own truth.
inline double power_given_w(const std::vector<StationSample>& rows) {
  double most = 0;
  for (const StationSample& row : rows) most = std::fmax(most, row.true_f_nm * row.true_v_rad_s);
  return most;
}

// What stands in each line besides the metrics, which come last.
inline const std::vector<std::string>& ordinary_columns() {
  static const std::vector<std::string> columns = [] {
    std::vector<std::string> all{"session",       "rows_digest",       "limits_master",
                                 "limits_slave",  "first_engaged_s_m", "first_engaged_s_s",
                                 "power_given_w", "verdict",           "stable"};
    for (const MetricInfo& info : kMetrics) {
      if (info.deterministic && !info.unit.empty() && info.key != "seed") all.emplace_back(info.key);
    }
    return all;
  }();
  return columns;
}

inline std::vector<std::string> ordinary_line(const std::string& name, const Session& session, const Metrics& metrics) {
  Digest digest;
  for (const auto* rows : {&session.master, &session.slave}) {
    for (const StationSample& row : *rows) {
      digest.add(static_cast<std::uint64_t>(row.state) << 32 | row.limits);
      for (const double y : {row.x_rad, row.v_rad_s, row.f_nm, row.target_x_rad, row.command_nm, row.x_cdob_rad,
                             row.alpha, row.true_x_rad, row.true_v_rad_s, row.true_f_nm})
        digest.add(y);
    }
  }
  const auto bits = [](std::uint32_t limits) {
    char text[16];
    std::snprintf(text, sizeof text, "%#x", limits);
    return std::string(text);
  };
  std::vector<std::string> line{name,
                                digest.text(),
                                bits(limits_ever(session.master)),
                                bits(limits_ever(session.slave)),
                                every_digit(first_engaged_s(session.master)),
                                every_digit(first_engaged_s(session.slave)),
                                every_digit(power_given_w(session.slave)),
                                metrics.text("verdict"),
                                metrics.is_true("stable")    ? "yes"
                                : metrics.is_false("stable") ? "no"
                                                             : "not judged"};
  for (const std::string& key : std::vector<std::string>(ordinary_columns().begin() + 9, ordinary_columns().end())) {
    line.push_back(every_digit(metrics.number(key)));
  }
  return line;
}

}  // namespace farhand
