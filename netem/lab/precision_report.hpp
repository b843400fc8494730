// Results of `farhand-lab precision`, for the terminal, for other programs and as one HTML file.
#pragma once

#include <ostream>
#include <string>

#include "netem/lab/precision.hpp"

namespace farhand {

void print_precision(const PrecisionResult& result, std::ostream& out);
std::string precision_json(const PrecisionResult& result);
// One line per tick, one column per integrator and step: error of position, then of force.
void write_precision_csv(const PrecisionResult& result, std::ostream& out);
std::string precision_html(const PrecisionResult& result);

}  // namespace farhand
