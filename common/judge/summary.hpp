// The numbers of a run for other programs: summary.json and the CSV of every tick. Same run, same bytes.
#pragma once

#include <ostream>
#include <string>

#include "common/judge/metrics.hpp"

namespace farhand {

// Flat keys in the order of kMetrics; absent values are null; numbers rounded to six significant digits, so that builds
// which differ in the last bits agree. Figures of the wall clock are left out unless asked for.
std::string summary_json(const Metrics& metrics, bool with_wall_clock);

// One row per tick and side, in order of time (master first); NaN is an empty field. Column names carry the unit.
void write_csv(const Session& session, std::ostream& out);

}  // namespace farhand
