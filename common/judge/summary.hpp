// The numbers of a run for other programs: summary.json and the CSV of every tick. Same run, same bytes.
#pragma once

#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "common/judge/metrics.hpp"

namespace farhand {

// Flat keys in the order of kMetrics; absent values are null; numbers rounded to six significant digits, so that builds
// which differ in the last bits agree. Figures of the wall clock are left out unless asked for.
std::string summary_json(const Metrics& metrics, bool with_wall_clock);

// A text, or a list in one cell, for a table with commas between cells.
std::string csv_cell(const std::string& text);
std::string csv_cell(const std::vector<std::string>& list);

// The same as one row of a table: without figures of the wall clock, a list in one cell. Absent values are empty.
std::vector<std::string_view> metrics_columns();
std::string metrics_row(const Metrics& metrics);

// One row per tick and side, in order of time (master first); NaN is an empty field. Column names carry the unit.
void write_csv(const Session& session, std::ostream& out);

}  // namespace farhand
