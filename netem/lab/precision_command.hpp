// farhand-lab precision SCENE: what its numbers are worth and what they cost, integrator by integrator.
#pragma once

#include "common/runtime/program.hpp"
#include "netem/lab/precision.hpp"

namespace farhand {

struct PrecisionChoice {
  SceneChoice scene;
  PrecisionSettings settings;
  std::string json, csv, report;
};

Command add_precision(Command program, PrecisionChoice& choice);
int run_precision(PrecisionChoice choice);

}  // namespace farhand
