#include "netem/lab/extreme.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <numeric>

#include "common/config/schema.hpp"

namespace farhand::extreme {

const char* name_of(Block block) {
  constexpr const char* kNames[] = {"none", "settings", "integrator", "encoder", "receiver", "observer",
                                    "law",  "gate",     "packet",     "link",    "mcu"};
  return kNames[static_cast<int>(block)];
}

const char* name_of(Verdict verdict) {
  constexpr const char* kNames[] = {"accurate", "bounded", "refused"};
  return kNames[static_cast<int>(verdict)];
}

std::string complaint(const Expected& expected, const Outcome& outcome) {
  if (outcome.bad_at_actuator) return "a command that is no number reached an actuator";
  if (outcome.work > outcome.budget) return "took " + std::to_string(outcome.work) + " steps of work, too many";
  if (outcome.first_bad != expected.first_bad)
    return std::string("first bad number in ") + name_of(outcome.first_bad) + ", expected in " +
           name_of(expected.first_bad);
  if (!std::isnan(outcome.energy) && !(outcome.energy <= outcome.energy_within))
    return "energy out of balance by " + shortest(outcome.energy) + ", allowed " + shortest(outcome.energy_within);
  if (expected.verdict == Verdict::kRefused) {
    if (outcome.refusal.empty()) return "ran, but had to be refused";
    if (outcome.refusal.find(expected.reason) == std::string::npos)
      return "refused for another reason: " + outcome.refusal;
    return "";
  }
  if (!outcome.refusal.empty()) return "refused: " + outcome.refusal;
  if (!(outcome.error <= expected.within))
    return shortest(outcome.error) + " " + outcome.unit + " instead of at most " + shortest(expected.within);
  return "";
}

namespace {

Result result_of(const Case& c) {
  const auto start = std::chrono::steady_clock::now();
  Outcome outcome;
  try {
    outcome = c.run();
  } catch (const std::exception& error) {
    outcome = {};
    outcome.refusal = error.what();
    outcome.what = "refused before it ran";
  }
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  std::string words = complaint(c.expected, outcome);
  return {&c, std::move(outcome), std::move(words), wall_s};
}

}  // namespace

std::vector<Result> run(const std::vector<Case>& cases, const Workload& work) {
  std::vector<Result> results(cases.size());
  std::vector<std::size_t> order(cases.size());  // long ones first, so that no thread ends alone with one
  std::iota(order.begin(), order.end(), 0u);
  std::ranges::stable_sort(order, {}, [&](std::size_t k) { return cases[k].quick; });
  work.require_all(work.each(order.size(), [&](std::size_t k) { results[order[k]] = result_of(cases[order[k]]); }));
  return results;
}

}  // namespace farhand::extreme
