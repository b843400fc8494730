// farhand-lab sweep SCENE --set field=from:to:count: the same scene over and over, on all cores.
#pragma once

#include "common/runtime/program.hpp"

namespace farhand {

struct SweepChoice {
  SceneChoice scene;
  int threads = 0;  // 0: all cores
  std::string csv = "-";
};

Command add_sweep(Command program, SweepChoice& choice);
int run_sweep(const SweepChoice& choice);

}  // namespace farhand
