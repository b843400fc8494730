// An explanation as a table and as JSON.
#pragma once

#include <iosfwd>

#include "netem/lab/explain.hpp"

namespace farhand {

void print_explanation(const Explanation& explanation, std::ostream& out);

// The same text every time, but for what stands under a key wall_clock.
std::string json_text(const Explanation& explanation);

}  // namespace farhand
