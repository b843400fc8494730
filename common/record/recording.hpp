// One process's recording, written in the calling thread: for virtual time, and as the back end of Recorder.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <variant>

#include "common/record/mcap_writer.hpp"
#include "common/record/sample_codec.hpp"

namespace farhand {

// A sentence for /events without a heap: longer ones are cut, between two characters of UTF-8.
struct Note {
  Note() = default;
  explicit Note(std::string_view sentence) noexcept : size(sentence.copy(text.data(), text.size())) {
    if (size == sentence.size()) return;
    while (size > 0 && (static_cast<unsigned char>(sentence[size]) & 0xC0) == 0x80) --size;
  }
  std::string_view view() const noexcept { return {text.data(), size}; }

  std::array<char, 160> text{};
  std::size_t size = 0;
};

using Sample = std::variant<StationSample, LinkSample, McuSample, Note>;

// How a recording ended.
struct RecordingOutcome {
  std::filesystem::path file;  // NAME.mcap, or NAME.mcap.part if it could not be completed
  std::uint64_t written = 0;
  std::uint64_t overflow = 0;   // samples for which the ring had no room
  std::uint64_t unwritten = 0;  // samples that the disk did not take
  std::string problem;          // empty, or a sentence
};

class Recording {
 public:
  static constexpr Nanoseconds kChunkSpan = 250 * kMillisecond;

  // The role (master, slave, netem, mcu) decides which samples are recorded under which topic. Throws
  // std::runtime_error with the path and the reason when the file cannot be made, std::invalid_argument on an unknown
  // role. Where `file` or its .part exists already, a numbered one is made.
  Recording(const std::filesystem::path& file, const record::RunInfo& start);

  // A chunk is flushed whenever its samples span kChunkSpan. A kind of sample that the role does not record counts as
  // unwritten.
  void write(Nanoseconds t, const Sample& sample);
  void flush();

  // For the counters at the end; absent: what the start said stays.
  void friction(const DeviceFriction& now) { encode(now, info_); }

  // Writes the counters and completes the file. Never throws: a session does not fail because its recording did.
  RecordingOutcome finish(const StationCounters& counters, std::uint64_t overflow = 0) noexcept;

  std::uint64_t written() const { return file_writer_.written(); }
  std::uint64_t unwritten() const { return unwritten_ + file_writer_.unwritten(); }
  const std::string& last_error() const { return file_writer_.last_error(); }
  const NewFile& file() const { return file_writer_.file(); }

 private:
  template <class Message>
  void write_message(std::uint16_t channel, Nanoseconds t, const Message& message);

  record::RunInfo info_;
  McapWriter file_writer_;
  std::uint16_t info_channel_ = 0, event_channel_ = 0, sample_channel_ = 0;
  std::size_t sample_kind_ = 0;  // index in Sample
  Nanoseconds chunk_start_ = 0, last_ = 0;
  bool chunk_empty_ = true;
  std::uint64_t unwritten_ = 0;
  std::string bytes_;
  record::StationSample station_;
  record::LinkSample link_;
  record::McuSample mcu_;
  record::Event event_;
};

// The id under which processes of this machine, since it was last started, share one monotonic clock.
std::string host_clock_id();

}  // namespace farhand
