// Results of the rogue search, as text, JSON and HTML.
#pragma once

#include <string>
#include <vector>

#include "netem/lab/rogue_search.hpp"

namespace farhand::rogue {

// One line: measured value, bound, time.
std::string text_of(const Outcome& outcome);
std::string text_of(const std::vector<CellResult>& results);
// Every row above `ratio`, one a line, as `--replay` takes it.
std::string rows_of(const std::vector<CellResult>& results, double ratio);
std::string json_of(const std::vector<CellResult>& results, const Budget& budget);
std::string html_of(const std::vector<CellResult>& results, const Budget& budget);

}  // namespace farhand::rogue
