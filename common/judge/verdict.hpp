// The verdict of a session, ok, degraded or failed, with its reasons.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/judge/metrics.hpp"

namespace farhand {

enum class Verdict { kOk, kDegraded, kFailed };

std::string_view name_of(Verdict verdict);

struct Judgement {
  Verdict verdict = Verdict::kOk;
  std::vector<std::string> reasons;  // a PC that missed its ticks, then failed ones
};

// Failed: a fault, never engaged, or unstable, if stability is judged. Degraded: a limit of the scene exceeded, more
// than 1 % of the ticks overrun, a side held without a request of its operator, a recording that ends early, a PC that
// missed more than 1 % of its ticks or stood still for longer than 50 ms. With such a PC stability is not judged.
Judgement judge(const Session& session, const scene::Scene& scene, const Metrics& metrics);

// Share of the ticks due that were skipped; NaN where none was due.
double missed_share(const StationCounters& counters);

// From one tick to the next, s; NaN where this is not known: fewer than two rows, or rows that were not kept.
double longest_gap_s(const std::vector<StationSample>& rows, const StationCounters& counters);

// Time during which a side held after it had been engaged. A hold that the operator asked for does not count, nor one
// that began when the other side had come to the end of its run.
double unwanted_hold_s(const Session& session, const scene::Scene& scene);

}  // namespace farhand
