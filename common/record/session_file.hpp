// Reads recordings into a Session in memory and writes them: the file of one process, the merged session.mcap, and the
// directory of a run.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "common/record/sample_codec.hpp"

namespace farhand {

// The content of one recording, on its own clock.
struct Recorded {
  template <class T>
  using Series = std::vector<std::pair<Nanoseconds, T>>;

  record::RunInfo info;  // the newest: with counters if the process ended cleanly
  Series<StationSample> master, slave;
  Series<LinkSample> link;
  Series<McuSample> mcu;
  std::vector<record::Event> events;
  std::vector<std::string> problems;  // sentences about damage and a missing end
};

// Throws std::runtime_error if the file cannot be read or is not a recording of ours; damage is reported in `problems`.
Recorded read_recording(const std::filesystem::path& file);

// One file with both stations on the master's clock, t_ns counted from the start of the run. Returns the new file:
// where `file` exists already, a numbered one. Both throw std::runtime_error.
std::filesystem::path write_session_mcap(const Session& session, const std::filesystem::path& file);
Session read_session_mcap(const std::filesystem::path& file);

// Makes root/UTC-SCENE-SEED (UTC as 20260131T235959Z) and returns it; if it exists, -2, -3, ... is appended. Throws
// std::runtime_error when it cannot be made.
std::string session_directory(const std::filesystem::path& root, std::int64_t utc_ns, const std::string& scene,
                              std::uint64_t seed);

}  // namespace farhand
