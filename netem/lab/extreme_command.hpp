// farhand-lab extreme: runs the catalogue and says which case did not come out as expected.
#pragma once

#include <memory>
#include <string>

#include "common/runtime/command.hpp"

namespace farhand {

struct ExtremeChoice {
  std::string family;  // empty: all
  int threads = 0;     // 0: as many as there are cores
  std::string json, csv, report;
};

Command add_extreme(Command program, ExtremeChoice& choice);
// Exit code: 0 only if every case has its expected verdict.
int run_extreme(const ExtremeChoice& choice);

}  // namespace farhand
