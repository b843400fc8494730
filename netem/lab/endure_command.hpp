// farhand-lab endure SCENE: its session again and again for hours of virtual time, a line for each.
#pragma once

#include "common/runtime/program.hpp"

namespace farhand {

struct EndureChoice {
  SceneChoice scene;
  double hours = 24, line_s = 3600;
  std::string json;
};

Command add_endure(Command program, EndureChoice& choice);
int endure_scene(const EndureChoice& choice);

}  // namespace farhand
