// Turns a scene file into settings that can run: text format of Protobuf, every value checked, defaults filled in.
// Throws before the loop starts, with one sentence for each mistake, which names place, value and allowed values.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "proto/scene.pb.h"

namespace farhand {

struct LoadedScene {
  scene::Scene scene;  // complete: absent settings hold their defaults
  std::string name;    // file name without directory and ending
  std::string path;
};

// what() holds all mistakes, one sentence per line.
class ConfigError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// name_or_path: a file (anything with a slash or ending in .txtpb), or the name of a scene in the scene directory,
// which is the environment's FARHAND_SCENES if set, else the one of the source tree. sets: "field.path=value" in text
// format, applied in order before anything is checked, so that they may also mend the file; path[i] is an element of a
// list, path[size] or plain path appends one. A group given by a set (slave.hand={...}) replaces the one of the file.
LoadedScene load_scene(const std::string& name_or_path, std::span<const std::string> sets = {},
                       std::optional<std::uint64_t> seed = {});

// The same from a text that is already in memory, such as the scene kept in a recording; path only names it.
LoadedScene load_scene_text(const std::string& text, const std::string& path, std::span<const std::string> sets = {},
                            std::optional<std::uint64_t> seed = {});

// Names of the scenes in the scene directory, sorted.
std::vector<std::string> known_scenes();

// The whole scene as text that loads to the same scene; the same bytes for the same settings.
std::string complete_text(const scene::Scene& scene);

}  // namespace farhand
