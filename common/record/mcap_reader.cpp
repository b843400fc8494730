#include "common/record/mcap_reader.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <map>
#include <set>
#include <stdexcept>
#include <utility>

#include "common/files/utf8.hpp"
#include "common/record/mcap_format.hpp"
#include "common/record/mcap_writer.hpp"

namespace farhand {
namespace {

using mcap::Cursor;
using mcap::Op;

// A checksum of 0 says that there is none.
bool agrees(std::uint32_t stated, std::uint32_t computed) { return stated == 0 || stated == computed; }

class Scan {
 public:
  Scan(const std::filesystem::path& file, const std::function<void(const McapMessage&)>& on_message)
      : name_(as_utf8(file.filename().string())), on_message_(on_message) {
    std::error_code error;
    size_ = std::filesystem::file_size(file, error);
    if (!error) in_.open(file, std::ios::binary);
    if (error || !in_) {
      throw std::runtime_error("cannot read " + file.string() + ": " +
                               (error ? error.message() : std::string(std::strerror(errno))));
    }
    std::string magic(mcap::kMagic.size(), '\0');
    if (size_ < magic.size() || !read(magic) || magic != mcap::kMagic) {
      throw std::runtime_error(file.string() + " is not an MCAP file: it does not begin with the MCAP magic bytes");
    }
  }

  McapFindings run() {
    while (next()) {
    }
    found_.complete = found_.problems.empty();
    return std::move(found_);
  }

 private:
  bool read(std::string& bytes) {
    in_.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    if (!in_) return false;
    offset_ += bytes.size();
    data_crc_.process_bytes(bytes.data(), bytes.size());
    return true;
  }

  void problem(std::string text) { found_.problems.push_back(name_ + ": " + std::move(text)); }

  bool stop_unfinished(std::uint64_t at) {
    const std::uint64_t rest = size_ - at;
    problem("was not closed, it has no index; " + std::to_string(found_.chunks) + " whole chunks" +
            (rest == 0
                 ? ""
                 : ", " + std::to_string(rest) + " bytes of a torn record at byte " + std::to_string(at) + " dropped"));
    return false;
  }

  bool stop_damaged(std::uint64_t at, const std::string& what) {
    problem(what + " at byte " + std::to_string(at) + " is damaged; nothing after it was read");
    return false;
  }

  // One record of the data section. False: there is nothing more to read.
  bool next() {
    const std::uint64_t at = offset_;
    std::string head(mcap::kRecordHead, '\0');
    if (size_ - at < head.size()) return stop_unfinished(at);
    const boost::crc_32_type crc_before = data_crc_;
    if (!read(head)) return stop_damaged(at, "the record");
    Cursor cursor(head);
    const auto op = static_cast<Op>(cursor.take<std::uint8_t>());
    const auto length = cursor.take<std::uint64_t>();
    if (length > size_ - offset_) return stop_unfinished(at);
    std::string content(length, '\0');
    if (!read(content)) return stop_damaged(at, "the record");

    switch (op) {
      case Op::kSchema:
        return schema(content) || stop_damaged(at, "the schema");
      case Op::kChannel:
        return channel(content) || stop_damaged(at, "the channel");
      case Op::kMessage:
        problem("a message outside any chunk, so without a checksum, at byte " + std::to_string(at) + " was left out");
        return true;
      case Op::kChunk:
        return chunk(at, content);
      case Op::kDataEnd: {
        Cursor data_end(content);
        const auto stated = data_end.take<std::uint32_t>();
        if (!data_end.ok() || !agrees(stated, crc_before.checksum()))
          problem("the checksum of the data section is wrong");
        summary();
        return false;
      }
      case Op::kNone:
      case Op::kFooter:  // only after the end of the data
        return stop_damaged(at, "the record");
      default:
        return true;  // message indexes need no reading here; kinds of record that are not known are to be passed over
    }
  }

  bool schema(std::string_view content) {
    Cursor cursor(content);
    const auto id = cursor.take<std::uint16_t>();
    McapChannel parts;
    parts.schema_name = cursor.take_string();
    parts.schema_encoding = cursor.take_string();
    parts.schema = cursor.take_string();
    if (cursor.ok()) schemas_.emplace(id, std::move(parts));
    return cursor.ok();
  }

  bool channel(std::string_view content) {
    Cursor cursor(content);
    const auto id = cursor.take<std::uint16_t>();
    const auto schema_id = cursor.take<std::uint16_t>();
    const auto known = schemas_.find(schema_id);
    if (schema_id != 0 && known == schemas_.end()) return false;
    McapChannel whole = schema_id == 0 ? McapChannel{} : known->second;
    whole.topic = cursor.take_string();
    whole.message_encoding = cursor.take_string();
    if (cursor.ok()) channels_.emplace(id, std::move(whole));  // a repeated one must be the same and changes nothing
    return cursor.ok();
  }

  bool message(std::string_view content, bool deliver) {
    Cursor cursor(content);
    const auto id = cursor.take<std::uint16_t>();
    cursor.take<std::uint32_t>();
    const auto time = cursor.take<std::uint64_t>();
    cursor.take<std::uint64_t>();
    const auto known = channels_.find(id);
    // A time beyond 2262 would be one before 1970 to those who count it with a sign.
    if (!cursor.ok() || known == channels_.end() || time >> 63 != 0) return false;
    if (!deliver) return true;
    ++found_.messages;
    on_message_({known->second, found_.chunks, static_cast<std::int64_t>(time), cursor.rest()});
    return true;
  }

  // Goes over the records of a chunk: first to see that all are whole, then to hand them over, so that a chunk counts
  // or does not.
  bool chunk_records(std::string_view records, bool deliver) {
    while (!records.empty()) {
      Cursor cursor(records);
      const auto op = static_cast<Op>(cursor.take<std::uint8_t>());
      const std::string_view content = cursor.take_bytes(cursor.take<std::uint64_t>());
      if (!cursor.ok()) return false;
      if (op == Op::kSchema && !schema(content)) return false;
      if (op == Op::kChannel && !channel(content)) return false;
      if (op == Op::kMessage && !message(content, deliver)) return false;
      records = cursor.rest();
    }
    return true;
  }

  bool chunk(std::uint64_t at, std::string_view content) {
    Cursor cursor(content);
    cursor.take<std::uint64_t>();
    cursor.take<std::uint64_t>();
    cursor.take<std::uint64_t>();
    const auto crc = cursor.take<std::uint32_t>();
    const std::string_view compression = cursor.take_string();
    const std::string_view records = cursor.take_bytes(cursor.take<std::uint64_t>());
    const std::string place = "the chunk at byte " + std::to_string(at);
    if (!cursor.ok()) {
      problem(place + " is damaged and was left out");
    } else if (!compression.empty()) {
      problem(place + " is compressed (" + as_utf8(compression.substr(0, 16)) + ") and was left out");
    } else if (!agrees(crc, mcap::crc32(records))) {
      problem(place + " has a wrong checksum and was left out");
    } else if (!chunk_records(records, false)) {
      problem(place + " holds damaged records and was left out");
    } else {
      ++found_.chunks;
      chunk_offsets_.insert(at);
      chunk_records(records, true);
    }
    return true;
  }

  // Everything after the data: must tell of the data just what was read.
  void summary() {
    const std::uint64_t begin = offset_;
    std::string all(size_ - offset_, '\0');
    const std::size_t tail = mcap::kRecordHead + 20 + mcap::kMagic.size();
    if (!read(all) || all.size() < tail || !all.ends_with(mcap::kMagic))
      return problem("the end of the index is missing");
    const std::string_view footer = std::string_view(all).substr(all.size() - tail);
    Cursor cursor(footer);
    const bool is_footer =
        static_cast<Op>(cursor.take<std::uint8_t>()) == Op::kFooter && cursor.take<std::uint64_t>() == 20;
    const auto summary_start = cursor.take<std::uint64_t>();
    const auto offsets_start = cursor.take<std::uint64_t>();
    const auto crc = cursor.take<std::uint32_t>();
    if (!is_footer) return problem("the footer is damaged");
    if (summary_start == 0) return problem("has no index");
    if (summary_start != begin || (offsets_start != 0 && offsets_start < begin))
      return problem("the footer is damaged");
    if (!agrees(crc, mcap::crc32(std::string_view(all).substr(0, all.size() - mcap::kMagic.size() - 4)))) {
      return problem("the checksum of the index is wrong");
    }
    Cursor records(std::string_view(all).substr(0, all.size() - tail));
    std::set<std::uint64_t> indexed;
    while (!records.rest().empty()) {
      const auto op = static_cast<Op>(records.take<std::uint8_t>());
      Cursor content(records.take_bytes(records.take<std::uint64_t>()));
      if (op == Op::kStatistics && content.take<std::uint64_t>() != found_.messages) {
        problem("the index counts other messages than there are");
      }
      if (op == Op::kChunkIndex) {
        content.take_bytes(16);
        indexed.insert(content.take<std::uint64_t>());
      }
      if (!records.ok() || !content.ok()) return problem("the index is damaged");
    }
    if (indexed != chunk_offsets_) problem("the index names other chunks than there are");
  }

  std::string name_;
  std::ifstream in_;
  const std::function<void(const McapMessage&)>& on_message_;
  std::uint64_t size_ = 0, offset_ = 0;
  boost::crc_32_type data_crc_;
  std::map<std::uint16_t, McapChannel> schemas_, channels_;  // of a schema only the schema_* are filled
  std::set<std::uint64_t> chunk_offsets_;
  McapFindings found_;
};

}  // namespace

McapFindings read_mcap(const std::filesystem::path& file, const std::function<void(const McapMessage&)>& on_message) {
  return Scan(file, on_message).run();
}

McapFindings recover_mcap(const std::filesystem::path& from, const std::filesystem::path& to) {
  // Not .part: that may be the very file that is being recovered.
  McapWriter out(to, ".recovering");
  if (out.file().file() != to) {
    out.discard();
    throw std::runtime_error(out.file().in_the_way().front().string() + " exists already: say another name as TO");
  }
  std::map<const McapChannel*, std::uint16_t> ids;
  std::uint64_t chunk = 0;
  const auto copy = [&](const McapMessage& message) {
    // A chunk stays a chunk.
    if (message.chunk != chunk && !out.flush()) {
      throw std::runtime_error("cannot write " + to.string() + ": " + out.last_error());
    }
    chunk = message.chunk;
    const auto [known, is_new] = ids.try_emplace(&message.channel);
    if (is_new) {
      const McapChannel& channel = message.channel;
      known->second = out.add_channel(channel.topic, channel.schema_name, channel.schema_encoding, channel.schema,
                                      channel.message_encoding);
    }
    out.write(known->second, message.time_ns, message.data);
  };
  try {
    McapFindings found = read_mcap(from, copy);
    out.close();
    return found;
  } catch (...) {
    out.discard();
    throw;
  }
}

}  // namespace farhand
