// What the loader says of a scene that is given as text.
#pragma once

#include <string>
#include <vector>

#include "common/config/load.hpp"

namespace farhand {

using Sets = std::vector<std::string>;

inline const std::string kBase = "architecture: FOUR_CHANNEL\nduration_s: 10\n";

inline scene::Scene load_text(const std::string& text, const Sets& sets = {}) {
  return load_scene_text(text, "FILE", sets).scene;
}

// What the loader complains about, or "" if the text loads.
inline std::string complaint(const std::string& text, const Sets& sets = {}) {
  try {
    load_text(text, sets);
    return "";
  } catch (const ConfigError& error) {
    return error.what();
  }
}

}  // namespace farhand
