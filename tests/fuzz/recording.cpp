// A recording, whole, torn or made up: what is read of it is told, what is recovered is complete and says the same, and
// a file of any content costs no more memory than its size suggests.
#include <cstdio>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/record/mcap_reader.hpp"
#include "common/record/session_file.hpp"
#include "tests/fuzz/targets.hpp"
#include "tests/support/scratch_directory.hpp"

namespace farhand::fuzz {
namespace {

struct Heard {
  std::vector<std::string> messages;  // topic, time, data
  McapFindings findings;
};

Heard read(const std::filesystem::path& file) {
  Heard heard;
  heard.findings = read_mcap(file, [&](const McapMessage& message) {
    heard.messages.push_back(message.channel.topic + " " + std::to_string(message.time_ns) + " " +
                             std::string(message.data));
  });
  require(heard.findings.messages == heard.messages.size(), "all messages that are counted are handed over");
  require(heard.findings.complete == heard.findings.problems.empty(), "complete is what has no problem");
  return heard;
}

}  // namespace

bool recording(Bytes input) {
  static const ScratchDirectory scratch;
  const auto file = scratch / "fuzzed.mcap", recovered = scratch / "recovered.mcap";
  write_bytes(file, {reinterpret_cast<const char*>(input.data()), input.size()});
  std::filesystem::remove(recovered);
  bool taken = false;
  try {
    const Heard heard = read(file);
    taken = !heard.messages.empty();
    recover_mcap(file, recovered);
    const Heard again = read(recovered);
    require(again.findings.complete, "what is recovered is complete");
    require(again.messages == heard.messages, "what is recovered says the same");
    read_recording(file);
    read_session_mcap(file);
  } catch (const std::runtime_error& error) {
    require(*error.what() != '\0', "what cannot be read is refused by a sentence");
  }
  return taken;
}

}  // namespace farhand::fuzz
