// The maps of limits as text, as CSV and as pictures.
#pragma once

#include <iosfwd>
#include <string>

#include "netem/lab/limits.hpp"

namespace farhand {

void print_limits(const std::vector<LimitMap>& maps, const std::vector<WallLimits>& walls, std::ostream& out);
void write_limits_csv(const std::vector<LimitMap>& maps, std::ostream& out);
std::string limits_html(const std::vector<LimitMap>& maps, const std::vector<WallLimits>& walls);

}  // namespace farhand
