// A scene and the --set that go with it, as text: lines that begin with "--set " are those. It loads, completely and to
// the same scene again, or it is refused by sentences that one can print.
#include <algorithm>
#include <string>
#include <vector>

#include "common/advice/warnings.hpp"
#include "common/config/load.hpp"
#include "tests/fuzz/targets.hpp"

namespace farhand::fuzz {
namespace {

bool printable(const std::string& text) {
  return !text.empty() &&
         std::none_of(text.begin(), text.end(), [](char c) { return (c >= 0 && c < ' ') || c == '\x7f'; });
}

void check_sentences(const std::string& what) {
  std::size_t lines = 0;
  for (std::size_t begin = 0; begin <= what.size(); ++lines) {
    const std::size_t end = std::min(what.find('\n', begin), what.size());
    require(printable(what.substr(begin, end - begin)), "every mistake is a sentence that one can print");
    begin = end + 1;
  }
  require(lines <= 51, "the mistakes do not flood a terminal");
}

}  // namespace

bool config(Bytes input) {
  constexpr std::string_view kSet = "--set ";
  std::string text;
  std::vector<std::string> sets;
  const std::string all(input.begin(), input.end());
  for (std::size_t begin = 0; begin < all.size();) {
    const std::size_t end = std::min(all.find('\n', begin), all.size());
    const std::string line = all.substr(begin, end - begin);
    if (line.starts_with(kSet) && sets.size() < 8) {
      sets.push_back(line.substr(kSet.size()));
    } else {
      text += line + "\n";
    }
    begin = end + 1;
  }
  try {
    const LoadedScene loaded = load_scene_text(text, "fuzzed.txtpb", sets);
    const std::string complete = complete_text(loaded.scene);
    require(complete_text(load_scene_text(complete, "complete.txtpb").scene) == complete,
            "a complete scene loads to itself");
    for (const std::string& warning : warnings(loaded.scene)) require(printable(warning), "a warning can be printed");
    return true;
  } catch (const ConfigError& error) {
    check_sentences(error.what());
  }
  return false;
}

}  // namespace farhand::fuzz
