// farhand-lab limits: where observers, force loop and sampled walls cease to be stable.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace farhand {

struct LimitsChoice {
  std::string csv, report;
};

CLI::App* add_limits(CLI::App& app, LimitsChoice& choice);
int run_limits(const LimitsChoice& choice);

}  // namespace farhand
