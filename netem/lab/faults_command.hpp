// farhand-lab faults: runs the fault matrix and says which row did not come out as expected.
#pragma once

#include <string>

#include "common/runtime/command.hpp"

namespace farhand {

struct FaultsChoice {
  std::string fault;  // empty: all
  std::string json, report;
};

Command add_faults(Command program, FaultsChoice& choice);
// Exit code: 0 only if every row came out as expected.
int run_faults(const FaultsChoice& choice);

}  // namespace farhand
