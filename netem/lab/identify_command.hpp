// farhand-lab identify: inertia, friction and spring of an axis from a recording in which it was moved.
#pragma once

#include <string>

#include "common/runtime/command.hpp"

namespace farhand {

struct IdentifyChoice {
  std::string file, side, json, loaded;
  double inertia_kgm2 = 0.0, added_kgm2 = 0.0;
};

Command add_identify(Command program, IdentifyChoice& choice);
int run_identify(const IdentifyChoice& choice);

}  // namespace farhand
