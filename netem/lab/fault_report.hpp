// The fault matrix as text, JSON and HTML.
#pragma once

#include <string>
#include <vector>

#include "netem/lab/fault_matrix.hpp"

namespace farhand::faults {

std::string text_of(const std::vector<Result>& results);
std::string json_of(const std::vector<Result>& results);
std::string html_of(const std::vector<Result>& results);

}  // namespace farhand::faults
