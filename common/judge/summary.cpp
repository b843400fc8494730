#include "common/judge/summary.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <vector>

#include "common/config/json.hpp"
#include "common/record/columns.hpp"

namespace farhand {
namespace {

constexpr int kDigits = 6;

double rounded(double y) {
  char buffer[48];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, y, std::chars_format::scientific, kDigits - 1);
  double out = y;
  std::from_chars(buffer, end.ptr, out);
  return out == 0 ? 0.0 : out;  // no -0
}

Json json_of(const MetricValue& value) {
  return std::visit(
      [](const auto& v) -> Json {
        using T = std::decay_t<decltype(v)>;
        if constexpr (std::is_same_v<T, std::monostate>)
          return {};
        else if constexpr (std::is_same_v<T, double>)
          return rounded(v);
        else
          return v;
      },
      value);
}

template <class Number>
void append(std::string& row, Number y) {
  char buffer[48];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, y);
  row.append(buffer, end.ptr);
}

// signals: of this side; columns: of both.
void write_row(std::string_view side, const StationSample& s, const std::vector<std::string>& signals,
               const std::vector<std::string>& columns, std::ostream& out) {
  std::string row(side);
  row += ',';
  append(row, s.t_s);
  row += ',';
  append(row, s.state);
  for (const auto& column : kStationColumns) {
    row += ',';
    const double y = s.*column.member;
    if (std::isfinite(y)) append(row, y);
  }
  row += ',';
  append(row, s.limits);
  for (const std::string& column : columns) {
    row += ',';
    const double y = law_signal(s, signals, column);
    if (std::isfinite(y)) append(row, y);
  }
  row += '\n';
  out.write(row.data(), static_cast<std::streamsize>(row.size()));
}

}  // namespace

std::string summary_json(const Metrics& metrics, bool with_wall_clock) {
  Json json = Json::object();
  for (const Metric& metric : metrics.all()) {
    if (metric.info->deterministic || with_wall_clock) json.set(metric.info->key, json_of(metric.value));
  }
  return json.dump(2) + "\n";
}

std::string csv_cell(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? "\"\"" : std::string(1, c);
  return out + '"';
}

std::string csv_cell(const std::vector<std::string>& list) {
  std::string all;
  for (const std::string& item : list) all += (all.empty() ? "" : "; ") + item;
  return csv_cell(all);
}

std::vector<std::string_view> metrics_columns() {
  std::vector<std::string_view> all;
  for (const MetricInfo& info : kMetrics) {
    if (info.deterministic) all.push_back(info.key);
  }
  return all;
}

std::string metrics_row(const Metrics& metrics) {
  std::string row;
  for (const Metric& metric : metrics.all()) {
    if (!metric.info->deterministic) continue;
    if (&metric != &metrics.all().front()) row += ',';
    if (const auto* text = std::get_if<std::string>(&metric.value)) {
      row += csv_cell(*text);
    } else if (const auto* list = std::get_if<std::vector<std::string>>(&metric.value)) {
      row += csv_cell(*list);
    } else if (!std::holds_alternative<std::monostate>(metric.value)) {
      row += json_of(metric.value).dump(0);
    }
  }
  return row;
}

void write_csv(const Session& session, std::ostream& out) {
  std::string header = "side,t_s,state";
  for (const auto& column : kStationColumns) (header += ',') += column.name;
  header += ",limits";
  std::vector<std::string> signals = session.master_signals;
  for (const std::string& name : session.slave_signals) {
    if (std::ranges::find(signals, name) == signals.end()) signals.push_back(name);
  }
  for (const std::string& name : signals) (header += ',') += name;
  out << header << '\n';
  std::size_t m = 0, s = 0;
  while (m < session.master.size() || s < session.slave.size()) {
    const bool master_next =
        s == session.slave.size() || (m < session.master.size() && session.master[m].t_s <= session.slave[s].t_s);
    if (master_next)
      write_row("master", session.master[m++], session.master_signals, signals, out);
    else
      write_row("slave", session.slave[s++], session.slave_signals, signals, out);
  }
}

}  // namespace farhand
