// Writes one MCAP file: uncompressed chunks with CRC and message index, then the summary for indexed readers. The file
// is called NAME.part until close() has succeeded, and is always new: if NAME or NAME.part exists, NAME-2 is written. A
// chunk goes out in one write and is removed completely if that fails. The disk therefore always holds complete chunks,
// except for a last one that a kill has cut off.
#pragma once

#include <google/protobuf/descriptor.h>

#include <boost/crc.hpp>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/files/output.hpp"

namespace farhand {

class McapWriter {
 public:
  // Throws std::runtime_error with the path and the reason when the file cannot be made.
  explicit McapWriter(const std::filesystem::path& wanted, std::string_view unfinished_suffix = ".part");
  ~McapWriter();  // without close(): what was flushed stays under the unfinished name
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;

  // Schemas and channels precede the first chunk, so that no torn chunk can take them along. Throws if they cannot be
  // written.
  std::uint16_t add_channel(std::string_view topic, const google::protobuf::Descriptor& type);
  std::uint16_t add_channel(std::string_view topic, std::string_view schema_name, std::string_view schema_encoding,
                            std::string_view schema, std::string_view message_encoding);

  // Adds to the chunk in memory. MCAP knows no time before 0: earlier times are indexed as 0.
  void write(std::uint16_t channel, std::int64_t time_ns, std::string_view message);

  // Hands the chunk to the operating system. False: the disk did not take it; its messages are counted as unwritten and
  // dropped.
  bool flush();

  // Flushes, writes the summary, syncs and renames. Throws std::runtime_error when that fails; the unfinished file then
  // remains.
  void close();

  std::uint64_t written() const { return written_; }      // messages in flushed chunks
  std::uint64_t unwritten() const { return unwritten_; }  // messages the disk did not take
  const std::string& last_error() const { return last_error_; }
  const NewFile& file() const { return file_; }
  void discard() noexcept { file_.discard(); }  // removes the unfinished file; nothing may follow

 private:
  struct Chunk {
    std::uint64_t start = 0, end = 0, count = 0;
    std::string records;
    std::map<std::uint16_t, std::vector<std::pair<std::uint64_t, std::uint64_t>>> index;  // per channel: time, offset
  };
  struct ChunkPlace {
    std::uint64_t start, end, offset, length, index_length, size;
    std::map<std::uint16_t, std::uint64_t> index_offsets;
  };
  struct Channel {
    std::uint64_t count = 0;
    std::uint32_t sequence = 0;
  };

  bool append(std::string_view bytes);
  std::string summary() const;

  NewFile file_;
  std::uint64_t offset_ = 0;
  boost::crc_32_type data_crc_;
  std::map<std::string, std::uint16_t, std::less<>> schema_ids_;
  std::string schema_records_, channel_records_;
  std::map<std::uint16_t, Channel> channels_;
  Chunk chunk_;
  std::vector<ChunkPlace> places_;
  std::uint64_t start_ = 0, end_ = 0, written_ = 0, unwritten_ = 0;
  std::string last_error_;
};

// The file of a message type and all that it imports, as MCAP wants it: a serialized FileDescriptorSet.
std::string file_descriptor_set(const google::protobuf::Descriptor& type);

}  // namespace farhand
