// The published list with its values, however they were computed.
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "common/judge/metrics.hpp"

namespace farhand {

Metrics::Metrics() {
  for (const MetricInfo& info : kMetrics) all_.push_back({&info, {}, "not computed"});
}

Metric& Metrics::find(std::string_view key) {
  for (Metric& metric : all_) {
    if (metric.info->key == key) return metric;
  }
  throw std::out_of_range("no metric is published under the name " + std::string(key));
}

const Metric& Metrics::at(std::string_view key) const { return const_cast<Metrics*>(this)->find(key); }

void Metrics::set(std::string_view key, MetricValue value) {
  Metric& metric = find(key);
  const double* number = std::get_if<double>(&value);
  if (number != nullptr && !std::isfinite(*number)) return set_absent(key, "not measured");
  metric.value = std::move(value);
  metric.absent_because.clear();
}

void Metrics::set_absent(std::string_view key, std::string because) {
  Metric& metric = find(key);
  metric.value = std::monostate{};
  metric.absent_because = std::move(because);
}

double Metrics::number(std::string_view key) const {
  const double* value = std::get_if<double>(&at(key).value);
  return value != nullptr ? *value : kAbsent;
}

std::string Metrics::text(std::string_view key) const {
  const std::string* value = std::get_if<std::string>(&at(key).value);
  return value != nullptr ? *value : std::string();
}

bool Metrics::is_true(std::string_view key) const {
  const bool* value = std::get_if<bool>(&at(key).value);
  return value != nullptr && *value;
}

bool Metrics::is_false(std::string_view key) const {
  const bool* value = std::get_if<bool>(&at(key).value);
  return value != nullptr && !*value;
}

const std::vector<std::string>& Metrics::list(std::string_view key) const {
  static const std::vector<std::string> kNothing;
  const auto* value = std::get_if<std::vector<std::string>>(&at(key).value);
  return value != nullptr ? *value : kNothing;
}

}  // namespace farhand
