// The comparison of sessions for readers: a table for the terminal, one HTML file, and JSON.
#pragma once

#include <string>
#include <vector>

#include "netem/lab/compare.hpp"

namespace farhand {

std::string comparison_text(const std::vector<ComparedSession>& sessions);
std::string comparison_html(const std::vector<ComparedSession>& sessions);
// {"sessions": [{"name", "architecture", "ran_in", "metrics": as of `run --json`}], "differences": [...]}
std::string comparison_json(const std::vector<ComparedSession>& sessions);

}  // namespace farhand
