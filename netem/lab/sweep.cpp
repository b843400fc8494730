#include "netem/lab/sweep.hpp"

#include <malloc.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <exception>
#include <map>
#include <mutex>
#include <new>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "common/advice/warnings.hpp"
#include "common/config/load.hpp"
#include "common/config/schema.hpp"
#include "common/judge/metrics.hpp"
#include "common/judge/summary.hpp"
#include "netem/lab/simulation.hpp"

namespace farhand {
namespace {

constexpr std::size_t kMostScenes = 1'000'000;

bool number(std::string_view text, auto& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

std::vector<std::string_view> split(std::string_view text, char at) {
  std::vector<std::string_view> parts;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(at, begin), text.size());
    parts.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

// None: an ordinary setting.
std::optional<SweptAxis> axis_of(const std::string& set) {
  const std::size_t equals = set.find('=');
  if (equals == std::string::npos) return {};
  const std::string_view names = std::string_view(set).substr(0, equals),
                         range = std::string_view(set).substr(equals + 1);
  const std::vector<std::string_view> parts = split(range, ':');
  const bool several = names.find(',') != std::string_view::npos;
  // Groups and texts hold colons too: {delay_s: 0.1}.
  const bool group =
      range.starts_with('{') || range.starts_with('<') || range.starts_with('"') || range.starts_with('\'');
  if (!several && (parts.size() < 2 || group)) return {};
  SweptAxis axis;
  const bool fine = parts.size() == 3 && number(parts[0], axis.from) && number(parts[1], axis.to) &&
                    number(parts[2], axis.count) && axis.count > 0 && std::isfinite(axis.to - axis.from);
  if (!fine) throw std::invalid_argument("--set " + set + ": a range is from:to:count, such as 0:0.2:5");
  if (axis.count == 1 && axis.from != axis.to)
    throw std::invalid_argument("--set " + set +
                                ": both ends are included, so a range from one to another counts 2 or more");
  for (const std::string_view name : split(names, ',')) {
    if (name.empty()) throw std::invalid_argument("--set " + set + ": a field has no name");
    axis.fields.emplace_back(name);
  }
  return axis;
}

struct Row {
  std::string text;
  bool refused = false, failed = false;
};

// What is given twice has one value only, and a column would tell of the other.
void require_once(const SweepAsked& asked) {
  const auto within = [](std::string_view a, std::string_view b) {
    return a == b || (a.starts_with(b) && a[b.size()] == '.');
  };
  std::vector<std::string_view> swept_fields;
  for (const SweptAxis& axis : asked.axes) {
    for (const std::string& field : axis.fields) {
      for (const std::string_view other : swept_fields) {
        if (within(field, other) || within(other, field))
          throw std::invalid_argument("--set " + field + " is swept twice, with " + std::string(other));
      }
      for (const std::string& set : asked.sets) {
        const std::string_view name = std::string_view(set).substr(0, set.find('='));
        if (name == field)
          throw std::invalid_argument("--set " + field + " is swept, and set to one value by --set " + set);
      }
      if (field == "seed" && asked.seed)
        throw std::invalid_argument("--set seed is swept, and --seed sets it to one value");
      swept_fields.push_back(field);
    }
  }
}

// Rows leave in order, whichever is done first.
class InOrder {
 public:
  explicit InOrder(std::ostream& out) : out_(out) {}

  void put(std::size_t k, Row row) {
    const std::lock_guard lock(mutex_);
    waiting_.emplace(k, std::move(row));
    for (auto next = waiting_.find(done_.rows); next != waiting_.end(); next = waiting_.find(done_.rows)) {
      out_ << next->second.text << '\n';
      done_.refused += next->second.refused;
      done_.failed += next->second.failed;
      ++done_.rows;
      waiting_.erase(next);
    }
    if (!out_.flush()) throw std::runtime_error("no more rows can be written");
  }
  const Swept& done() const { return done_; }

 private:
  std::ostream& out_;
  std::mutex mutex_;
  std::map<std::size_t, Row> waiting_;
  Swept done_;
};

std::vector<double> values_of(const SweepAsked& asked, std::size_t k) {
  std::vector<double> out(asked.axes.size());
  for (std::size_t i = out.size(); i-- > 0; k /= asked.axes[i].count)
    out[i] = asked.axes[i].at(k % asked.axes[i].count);
  return out;
}

LoadedScene scene_of(const SweepAsked& asked, const std::vector<double>& values) {
  std::vector<std::string> sets = asked.sets;
  for (std::size_t i = 0; i < values.size(); ++i) {
    for (const std::string& field : asked.axes[i].fields) sets.push_back(field + '=' + shortest(values[i]));
  }
  return load_scene(asked.scene, sets, asked.seed);
}

// A mistake that is in every scene, such as a field that is none, is said before anything runs.
void require_one(const SweepAsked& asked) {
  const auto refusal = [&](std::size_t k) -> std::exception_ptr {
    try {
      scene_of(asked, values_of(asked, k));
      return nullptr;
    } catch (const std::exception&) {
      return std::current_exception();
    }
  };
  const std::exception_ptr first = refusal(0);
  if (first && refusal(asked.scenes() - 1)) std::rethrow_exception(first);
}

Row row_of(const SweepAsked& asked, std::size_t k, const Workload& work) {
  const std::vector<double> values = values_of(asked, k);
  Row row;
  for (const double value : values) row.text += shortest(value) + ',';
  try {
    const LoadedScene loaded = scene_of(asked, values);
    const std::function<void(double)> go_on = [&](double) { work.require_all(!work.stopped()); };
    const Metrics metrics = compute_metrics(simulate(loaded, go_on), loaded.scene);
    row.failed = metrics.text("verdict") == "failed";
    row.text += ',' + csv_cell(warnings(loaded.scene)) + ',' + metrics_row(metrics);
  } catch (const std::bad_alloc&) {
    throw std::runtime_error("a session of this length needs more memory than there is; take fewer --threads");
  } catch (const std::exception& refused) {
    row.refused = true;
    std::string why = refused.what();
    std::ranges::replace(why, '\n', ' ');
    row.text += csv_cell(why) + std::string(metrics_columns().size() + 1, ',');
  }
  return row;
}

}  // namespace

double SweptAxis::at(std::size_t k) const {
  return count > 1 ? from + (to - from) * static_cast<double>(k) / static_cast<double>(count - 1) : from;
}

std::size_t SweepAsked::scenes() const {
  std::size_t all = 1;
  for (const SweptAxis& axis : axes) {
    if (axis.count > kMostScenes / all) throw std::invalid_argument("a sweep has at most a million scenes");
    all *= axis.count;
  }
  return all;
}

SweepAsked swept(const std::string& scene, const std::vector<std::string>& sets, std::optional<std::uint64_t> seed) {
  SweepAsked asked{scene, {}, {}, seed};
  for (const std::string& set : sets) {
    if (std::optional<SweptAxis> axis = axis_of(set)) {
      asked.axes.push_back(std::move(*axis));
    } else {
      asked.sets.push_back(set);
    }
  }
  require_once(asked);
  asked.scenes();
  return asked;
}

Swept sweep(const SweepAsked& asked, const Workload& work, std::ostream& out) {
  require_one(asked);
  // Every session takes and frees the same memory. Given back each time, the kernel would clear it each time.
  constexpr int kMost = 1 << 28;  // bytes
  ::mallopt(M_MMAP_THRESHOLD, kMost);
  ::mallopt(M_TRIM_THRESHOLD, kMost);
  for (const SweptAxis& axis : asked.axes) {
    for (std::size_t k = 0; k < axis.fields.size(); ++k) out << (k > 0 ? "+" : "set.") << axis.fields[k];
    out << ',';
  }
  out << "refused,warnings";
  for (const std::string_view column : metrics_columns()) out << ',' << column;
  out << '\n';
  InOrder rows(out);
  try {
    work.each(asked.scenes(), [&](std::size_t k) { rows.put(k, row_of(asked, k, work)); });
  } catch (const Stopped&) {
    // The rows that are whole stand there.
  }
  return rows.done();
}

}  // namespace farhand
