#include "common/runtime/operator_words.hpp"

#include <algorithm>

namespace farhand {
namespace {

bool same_in_any_case(std::string_view word, std::string_view small) noexcept {
  const auto same = [](char c, char letter) { return (c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c) == letter; };
  return std::equal(word.begin(), word.end(), small.begin(), small.end(), same);
}

}  // namespace

std::optional<OperatorAct> act_of_word(std::string_view word) noexcept {
  for (const std::string_view stop : {"stop", "quit", "s", "q"}) {
    if (same_in_any_case(word, stop)) return OperatorAct::kStop;
  }
  if (same_in_any_case(word, "hold")) return OperatorAct::kHold;
  if (word == "engage") return OperatorAct::kEngage;
  if (word == "reset") return OperatorAct::kReset;
  if (word == "home") return OperatorAct::kHome;
  if (word == "identify") return OperatorAct::kIdentify;
  if (word == "friction") return OperatorAct::kSweep;
  return std::nullopt;
}

}  // namespace farhand
