#pragma once

#include <string>
#include <vector>

#include "common/advice/warnings.hpp"
#include "common/config/load.hpp"

namespace farhand {

using Sets = std::vector<std::string>;

inline LoadedScene load(const std::string& text, const Sets& sets = {}) { return load_scene_text(text, "FILE", sets); }

inline std::string said(const LoadedScene& loaded) {
  std::string all;
  for (const std::string& warning : warnings(loaded.scene)) all += warning + '\n';
  return all;
}

}  // namespace farhand
