#include "common/record/mcap_writer.hpp"

#include <google/protobuf/descriptor.pb.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <set>
#include <stdexcept>

#include "common/record/mcap_format.hpp"

namespace farhand {
namespace {

using mcap::Op;
using mcap::put;
using mcap::put_record;
using mcap::put_string;

std::string reason() { return std::strerror(errno); }

void add_file(const google::protobuf::FileDescriptor& file, std::set<std::string>& seen,
              google::protobuf::FileDescriptorSet& set) {
  if (!seen.insert(file.name()).second) return;
  for (int i = 0; i < file.dependency_count(); ++i) add_file(*file.dependency(i), seen, set);
  file.CopyTo(set.add_file());
}

}  // namespace

std::string file_descriptor_set(const google::protobuf::Descriptor& type) {
  std::set<std::string> seen;
  google::protobuf::FileDescriptorSet set;
  add_file(*type.file(), seen, set);
  return set.SerializeAsString();
}

McapWriter::McapWriter(const std::filesystem::path& wanted, std::string_view unfinished_suffix)
    : file_(wanted, unfinished_suffix) {
  std::string header, bytes{mcap::kMagic};
  put_string(header, "");  // no profile
  put_string(header, "farhand");
  put_record(bytes, Op::kHeader, header);
  if (!append(bytes)) {
    discard();
    throw std::runtime_error("cannot record to " + file_.unfinished().string() + ": " + last_error_);
  }
}

McapWriter::~McapWriter() {
  if (file_.descriptor() >= 0) flush();
}

std::uint16_t McapWriter::add_channel(std::string_view topic, const google::protobuf::Descriptor& type) {
  return add_channel(topic, type.full_name(), "protobuf", file_descriptor_set(type), "protobuf");
}

std::uint16_t McapWriter::add_channel(std::string_view topic, std::string_view schema_name,
                                      std::string_view schema_encoding, std::string_view schema,
                                      std::string_view message_encoding) {
  std::string schema_record, channel_record;
  auto known = schema_ids_.find(schema_name);
  if (known == schema_ids_.end()) {
    // Schema 0 means "none", so the numbers begin at 1.
    known = schema_ids_.emplace(schema_name, static_cast<std::uint16_t>(schema_ids_.size() + 1)).first;
    std::string content;
    put(content, known->second);
    put_string(content, schema_name);
    put_string(content, schema_encoding);
    put_string(content, schema);
    put_record(schema_record, Op::kSchema, content);
  }
  const auto id = static_cast<std::uint16_t>(channels_.size() + 1);
  std::string content;
  put(content, id);
  put(content, known->second);
  put_string(content, topic);
  put_string(content, message_encoding);
  put_string(content, "");  // no metadata
  put_record(channel_record, Op::kChannel, content);
  if (!append(schema_record + channel_record)) {
    throw std::runtime_error("cannot record to " + file_.unfinished().string() + ": " + last_error_);
  }
  schema_records_ += schema_record;
  channel_records_ += channel_record;
  channels_[id] = {};
  return id;
}

void McapWriter::write(std::uint16_t channel, std::int64_t time_ns, std::string_view message) {
  const auto time = static_cast<std::uint64_t>(std::max<std::int64_t>(time_ns, 0));
  chunk_.index[channel].emplace_back(time, chunk_.records.size());
  std::string& out = chunk_.records;
  put(out, static_cast<std::uint8_t>(Op::kMessage));
  put(out, std::uint64_t{22} + message.size());  // 22: channel, sequence, two times
  put(out, channel);
  put(out, channels_.at(channel).sequence++);
  put(out, time);  // logged
  put(out, time);  // published
  out.append(message);
  chunk_.start = chunk_.count == 0 ? time : std::min(chunk_.start, time);
  chunk_.end = std::max(chunk_.end, time);
  ++chunk_.count;
}

bool McapWriter::flush() {
  if (chunk_.count == 0) return true;
  const Chunk chunk = std::exchange(chunk_, {});
  ChunkPlace place{chunk.start, chunk.end, offset_, 0, 0, chunk.records.size(), {}};

  std::string bytes;
  bytes.reserve(chunk.records.size() + 16 * chunk.count + 256);
  put(bytes, static_cast<std::uint8_t>(Op::kChunk));
  put(bytes, std::uint64_t{40} + chunk.records.size());  // 40: the fields up to the records
  put(bytes, chunk.start);
  put(bytes, chunk.end);
  put(bytes, static_cast<std::uint64_t>(chunk.records.size()));
  put(bytes, mcap::crc32(chunk.records));
  put_string(bytes, "");  // not compressed
  put(bytes, static_cast<std::uint64_t>(chunk.records.size()));
  bytes += chunk.records;
  place.length = bytes.size();

  for (const auto& [channel, entries] : chunk.index) {
    place.index_offsets[channel] = offset_ + bytes.size();
    put(bytes, static_cast<std::uint8_t>(Op::kMessageIndex));
    put(bytes, std::uint64_t{6} + 16 * entries.size());
    put(bytes, channel);
    put(bytes, static_cast<std::uint32_t>(16 * entries.size()));
    for (const auto& [time, where] : entries) {
      put(bytes, time);
      put(bytes, where);
    }
  }
  place.index_length = bytes.size() - place.length;

  if (!append(bytes)) {
    unwritten_ += chunk.count;
    return false;
  }
  for (const auto& [channel, entries] : chunk.index) channels_.at(channel).count += entries.size();
  start_ = written_ == 0 ? chunk.start : std::min(start_, chunk.start);
  end_ = std::max(end_, chunk.end);
  written_ += chunk.count;
  places_.push_back(std::move(place));
  return true;
}

bool McapWriter::append(std::string_view bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t n =
        ::pwrite(file_.descriptor(), bytes.data() + done, bytes.size() - done, static_cast<off_t>(offset_ + done));
    if (n > 0) {
      done += static_cast<std::size_t>(n);
    } else if (n == 0 || errno != EINTR) {
      last_error_ = n == 0 ? "nothing was written" : reason();
      // Half a chunk at the end would only be noise; if it cannot be cut off, the next chunk is written over it.
      [[maybe_unused]] const int cut = ::ftruncate(file_.descriptor(), static_cast<off_t>(offset_));
      return false;
    }
  }
  offset_ += bytes.size();
  data_crc_.process_bytes(bytes.data(), bytes.size());
  return true;
}

// Data end, summary, summary offsets, footer and magic: everything after the last chunk.
std::string McapWriter::summary() const {
  std::string out, data_end;
  put(data_end, data_crc_.checksum());
  put_record(out, Op::kDataEnd, data_end);
  const std::size_t summary_begin = out.size();

  std::string statistics_record, chunk_index_records;
  std::string statistics, counts;
  for (const auto& [id, channel] : channels_) {
    put(counts, id);
    put(counts, channel.count);
  }
  put(statistics, written_);
  put(statistics, static_cast<std::uint16_t>(schema_ids_.size()));
  put(statistics, static_cast<std::uint32_t>(channels_.size()));
  put(statistics, std::uint32_t{0});  // attachments
  put(statistics, std::uint32_t{0});  // metadata
  put(statistics, static_cast<std::uint32_t>(places_.size()));
  put(statistics, start_);
  put(statistics, end_);
  put_string(statistics, counts);
  put_record(statistics_record, Op::kStatistics, statistics);

  for (const ChunkPlace& place : places_) {
    std::string content, offsets;
    for (const auto& [channel, where] : place.index_offsets) {
      put(offsets, channel);
      put(offsets, where);
    }
    put(content, place.start);
    put(content, place.end);
    put(content, place.offset);
    put(content, place.length);
    put_string(content, offsets);
    put(content, place.index_length);
    put_string(content, "");  // not compressed
    put(content, place.size);
    put(content, place.size);
    put_record(chunk_index_records, Op::kChunkIndex, content);
  }

  std::string offsets;
  const auto group = [&](Op op, const std::string& records) {
    if (records.empty()) return;
    std::string content;
    put(content, static_cast<std::uint8_t>(op));
    put(content, offset_ + out.size());
    put(content, static_cast<std::uint64_t>(records.size()));
    put_record(offsets, Op::kSummaryOffset, content);
    out += records;
  };
  group(Op::kSchema, schema_records_);
  group(Op::kChannel, channel_records_);
  group(Op::kStatistics, statistics_record);
  group(Op::kChunkIndex, chunk_index_records);

  const std::uint64_t offsets_start = offset_ + out.size();
  out += offsets;
  put(out, static_cast<std::uint8_t>(Op::kFooter));
  put(out, std::uint64_t{20});
  put(out, offset_ + summary_begin);
  put(out, offsets_start);
  put(out, mcap::crc32(std::string_view(out).substr(summary_begin)));
  out += mcap::kMagic;
  return out;
}

void McapWriter::close() {
  flush();
  if (!append(summary())) {
    throw std::runtime_error("recording " + file_.unfinished().string() + " stays unfinished: " + last_error_);
  }
  file_.complete();
}

}  // namespace farhand
