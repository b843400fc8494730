// farhand-lab limits: where observers, force loop and sampled walls cease to be stable.
#pragma once

#include <string>

#include "common/runtime/command.hpp"

namespace farhand {

struct LimitsChoice {
  std::string csv, report;
};

Command add_limits(Command program, LimitsChoice& choice);
int run_limits(const LimitsChoice& choice);

}  // namespace farhand
