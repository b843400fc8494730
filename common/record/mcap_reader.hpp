// Reads MCAP files from front to back, finished or not, ours or hostile. It reads the data and not the index, so that
// finished and unfinished files are treated alike; an index is compared with the data. It also makes a complete file
// out of an unfinished one.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace farhand {

struct McapChannel {
  std::string topic, message_encoding, schema_name, schema_encoding, schema;
};

struct McapMessage {
  const McapChannel& channel;
  std::uint64_t chunk;  // counts the whole chunks of the file, from 1
  std::int64_t time_ns;
  std::string_view data;
};

struct McapFindings {
  bool complete = false;  // closed cleanly: data, index and all checksums agree
  std::uint64_t messages = 0, chunks = 0;
  std::vector<std::string> problems;  // sentences; empty exactly if complete
};

// Hands over the messages of every complete chunk with a correct checksum. Damage is reported in the findings; only a
// file that cannot be read or never was an MCAP file throws (std::runtime_error).
McapFindings read_mcap(const std::filesystem::path& file, const std::function<void(const McapMessage&)>& on_message);

// Writes what read_mcap finds into a complete file `to`; `from` stays as it is. Throws like read_mcap, and when `to`
// exists.
McapFindings recover_mcap(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace farhand
