// Results of the catalogue, for machines and for readers. They do not depend on the wall clock or the number of
// threads.
#pragma once

#include "netem/lab/extreme.hpp"

namespace farhand::extreme {

std::string summary_text(const std::vector<Result>& results);  // a few lines for the terminal
std::string json_of(const std::vector<Result>& results);
std::string csv_of(const std::vector<Result>& results);
std::string html_of(const std::vector<Result>& results);  // self-contained

}  // namespace farhand::extreme
