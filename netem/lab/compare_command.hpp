// farhand-lab compare: sessions of processes and of the lab side by side.
#pragma once

#include <string>

#include "common/runtime/command.hpp"
#include "netem/lab/compare.hpp"

namespace farhand {

struct CompareChoice {
  ComparisonAsked asked;
  std::string json, report;
};

Command add_compare(Command program, CompareChoice& choice);
int run_compare(const CompareChoice& choice);

}  // namespace farhand
