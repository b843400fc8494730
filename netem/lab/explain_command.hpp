// farhand-lab explain SCENE: which blocks, why, at what cost, and which integrator.
#pragma once

#include "common/runtime/program.hpp"

namespace farhand {

struct ExplainChoice {
  SceneChoice scene;
  std::string json;
};

Command add_explain(Command program, ExplainChoice& choice);
int explain_scene(const ExplainChoice& choice);

}  // namespace farhand
