#include "common/record/recording.hpp"

#include <fstream>
#include <stdexcept>

#include "common/files/utf8.hpp"
#include "common/record/stamps.hpp"

namespace farhand {

Recording::Recording(const std::filesystem::path& file, const record::RunInfo& start)
    : info_(start), file_writer_(file), last_(start.start_ns()) {
  const std::string& role = start.role();
  const google::protobuf::Descriptor* type = nullptr;
  if (role == "master" || role == "slave") {
    sample_kind_ = 0;
    type = record::StationSample::descriptor();
  } else if (role == "netem") {
    sample_kind_ = 1;
    type = record::LinkSample::descriptor();
  } else if (role == "mcu") {
    sample_kind_ = 2;
    type = record::McuSample::descriptor();
  } else {
    throw std::invalid_argument("no recording for role '" + role + "': must be master, slave, netem or mcu");
  }
  info_channel_ = file_writer_.add_channel("/info", *record::RunInfo::descriptor());
  event_channel_ = file_writer_.add_channel("/events", *record::Event::descriptor());
  sample_channel_ = file_writer_.add_channel("/" + role, *type);
  event_.set_who(role);
  info_.set_scene_name(as_utf8(start.scene_name()));
  info_.set_scene_text(as_utf8(start.scene_text()));
  write_message(info_channel_, start.start_ns(), info_);
  if (!file_writer_.flush()) {
    file_writer_.discard();
    throw std::runtime_error("cannot record to " + file_writer_.file().file().string() + ": " +
                             file_writer_.last_error());
  }
  chunk_empty_ = true;
}

template <class Message>
void Recording::write_message(std::uint16_t channel, Nanoseconds t, const Message& message) {
  if (chunk_empty_) chunk_start_ = t;
  chunk_empty_ = false;
  message.SerializeToString(&bytes_);
  file_writer_.write(channel, t, bytes_);
  last_ = t;
  if (stamp_difference(t, chunk_start_) >= kChunkSpan) flush();
}

void Recording::write(Nanoseconds t, const Sample& sample) {
  if (const auto* note = std::get_if<Note>(&sample)) {
    event_.set_t_ns(t);
    event_.set_text(as_utf8(note->view()));
    return write_message(event_channel_, t, event_);
  }
  if (sample.index() != sample_kind_) {
    ++unwritten_;
  } else if (const auto* station = std::get_if<StationSample>(&sample)) {
    encode(t, *station, station_);
    write_message(sample_channel_, t, station_);
  } else if (const auto* link = std::get_if<LinkSample>(&sample)) {
    encode(t, *link, link_);
    write_message(sample_channel_, t, link_);
  } else if (const auto* mcu = std::get_if<McuSample>(&sample)) {
    encode(t, *mcu, mcu_);
    write_message(sample_channel_, t, mcu_);
  }
}

void Recording::flush() {
  file_writer_.flush();
  chunk_empty_ = true;
}

RecordingOutcome Recording::finish(const StationCounters& counters, std::uint64_t overflow) noexcept {
  RecordingOutcome outcome;
  outcome.overflow = overflow;
  try {
    outcome.file = file().unfinished();
    flush();
    StationCounters totals = counters;
    totals.record_overflow = overflow;
    totals.record_unwritten = unwritten();
    record::Counters& message = *info_.add_counters();
    encode(totals, message);
    message.set_role(info_.role());
    write_message(info_channel_, last_, info_);
    file_writer_.close();
    outcome.file = file().file();
  } catch (const std::exception& error) {
    outcome.problem = error.what();
  }
  outcome.written = file_writer_.written();
  outcome.unwritten = unwritten();
  if (outcome.problem.empty() && outcome.overflow + outcome.unwritten > 0) {
    outcome.problem = outcome.file.string() + " has gaps: " + std::to_string(outcome.overflow) +
                      " samples found no room in memory, " + std::to_string(outcome.unwritten) +
                      " could not be written (" + file_writer_.last_error() + ")";
  }
  return outcome;
}

std::string host_clock_id() {
  std::ifstream boot("/proc/sys/kernel/random/boot_id");
  std::string id;
  std::getline(boot, id);
  return id;
}

}  // namespace farhand
