// farhand-lab rogue: looks for what an authentic peer, or an MCU that lies, can do to a person.
#pragma once

#include <optional>
#include <string>

#include "common/runtime/command.hpp"

namespace farhand {

struct RogueChoice {
  std::string against;  // patient, therapist or empty: both
  std::string cell;     // only cells whose name contains this
  std::string replay;   // a row to run instead of a search
  int sessions = 1000, threads = 0;
  std::optional<std::uint64_t> seed;
  std::string json, report;
};

Command add_rogue(Command program, RogueChoice& choice);
// Exit code: 0 only if no line was crossed.
int run_rogue(const RogueChoice& choice);

}  // namespace farhand
