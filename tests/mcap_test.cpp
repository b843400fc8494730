// The recording format: what is written is read, a killed writer loses at most the torn chunk, and no damaged file
// crashes, hangs or passes for a whole one.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <stdexcept>
#include <tuple>

#include "common/record/mcap_format.hpp"
#include "common/record/mcap_reader.hpp"
#include "common/record/mcap_writer.hpp"
#include "proto/record.pb.h"
#include "tests/support/scratch_directory.hpp"

namespace farhand {
namespace {

using Row = std::tuple<std::string, std::int64_t, std::string>;

std::vector<Row> rows_of(const std::filesystem::path& file, McapFindings* findings = nullptr) {
  std::vector<Row> rows;
  const McapFindings found = read_mcap(
      file, [&](const McapMessage& m) { rows.emplace_back(m.channel.topic, m.time_ns, std::string(m.data)); });
  if (findings != nullptr) *findings = found;
  return rows;
}

// Three chunks of five messages on two topics; `close` decides how it ends.
std::vector<Row> write_small(const std::filesystem::path& file, bool close) {
  McapWriter writer(file);
  const std::uint16_t a = writer.add_channel("/a", "A", "protobuf", "schema of A", "protobuf");
  const std::uint16_t b = writer.add_channel("/b", "B", "protobuf", "schema of B", "protobuf");
  std::vector<Row> rows;
  for (int i = 0; i < 15; ++i) {
    const std::string message(static_cast<std::size_t>(i), static_cast<char>('a' + i));
    writer.write(i % 3 == 0 ? b : a, 1000 + i, message);
    rows.emplace_back(i % 3 == 0 ? "/b" : "/a", 1000 + i, message);
    if (i % 5 == 4 && !writer.flush()) throw std::runtime_error(writer.last_error());
  }
  if (close) writer.close();
  return rows;
}

TEST(McapWriter, IsReadBackInOrder) {
  ScratchDirectory scratch;
  const auto expected = write_small(scratch / "x.mcap", true);
  McapFindings found;
  EXPECT_EQ(rows_of(scratch / "x.mcap", &found), expected);
  EXPECT_TRUE(found.complete);
  EXPECT_TRUE(found.problems.empty());
  EXPECT_EQ(found.messages, 15u);
  EXPECT_EQ(found.chunks, 3u);
  EXPECT_FALSE(std::filesystem::exists(scratch / "x.mcap.part"));
}

TEST(McapWriter, KeepsTheUnfinishedNameUntilClosed) {
  ScratchDirectory scratch;
  const auto expected = write_small(scratch / "x.mcap", false);
  EXPECT_FALSE(std::filesystem::exists(scratch / "x.mcap"));
  McapFindings found;
  EXPECT_EQ(rows_of(scratch / "x.mcap.part", &found), expected);
  EXPECT_FALSE(found.complete);
  ASSERT_EQ(found.problems.size(), 1u);
  EXPECT_NE(found.problems[0].find("was not closed"), std::string::npos) << found.problems[0];
}

TEST(McapWriter, StatesTheRangeOfTimeInTheStatistics) {
  ScratchDirectory scratch;
  {
    McapWriter writer(scratch / "x.mcap");
    const std::uint16_t channel = writer.add_channel("/a", *record::Event::descriptor());
    for (const std::int64_t t : {500, 700, 300, 900, 800}) {  // not in order: several producers on one axis
      writer.write(channel, t, "m");
      writer.flush();
    }
    writer.close();
  }
  const std::string bytes = file_bytes(scratch / "x.mcap");
  // Found by the footer, as an indexed reader does: summary offset -> group of the statistics -> its fields.
  mcap::Cursor footer(std::string_view(bytes).substr(bytes.size() - 28));
  const auto summary_start = footer.take<std::uint64_t>();
  const auto offsets_start = footer.take<std::uint64_t>();
  EXPECT_LT(summary_start, offsets_start);
  mcap::Cursor offsets(std::string_view(bytes).substr(offsets_start));
  std::uint64_t at = 0;
  while (offsets.take<std::uint8_t>() == static_cast<std::uint8_t>(mcap::Op::kSummaryOffset)) {
    mcap::Cursor group(offsets.take_bytes(offsets.take<std::uint64_t>()));
    if (group.take<std::uint8_t>() == static_cast<std::uint8_t>(mcap::Op::kStatistics))
      at = group.take<std::uint64_t>();
  }
  ASSERT_NE(at, 0u);
  mcap::Cursor statistics(std::string_view(bytes).substr(at + mcap::kRecordHead));
  EXPECT_EQ(statistics.take<std::uint64_t>(), 5u);  // messages
  EXPECT_EQ(statistics.take<std::uint16_t>(), 1u);  // schemas
  EXPECT_EQ(statistics.take<std::uint32_t>(), 1u);  // channels
  statistics.take_bytes(8);                         // attachments, metadata
  EXPECT_EQ(statistics.take<std::uint32_t>(), 5u);  // chunks
  EXPECT_EQ(statistics.take<std::uint64_t>(), 300u);
  EXPECT_EQ(statistics.take<std::uint64_t>(), 900u);
}

TEST(McapWriter, RefusesAFolderThatIsNotThere) {
  try {
    McapWriter writer("/nonexistent/folder/x.mcap");
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(std::string(error.what()),
              "cannot write /nonexistent/folder/x.mcap: /nonexistent/folder: No such file or directory");
  }
}

TEST(McapWriter, RefusesAFullDiskAtTheStart) {
  ScratchDirectory scratch;
  rlimit old_limit{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &old_limit), 0);
  std::signal(SIGXFSZ, SIG_IGN);
  const rlimit limit{0, old_limit.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &limit), 0);
  EXPECT_THROW(McapWriter(scratch / "x.mcap"), std::runtime_error);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &old_limit), 0);
  EXPECT_TRUE(std::filesystem::is_empty(scratch.path()));
}

TEST(McapReader, EveryTruncationKeepsTheWholeChunksAndSaysSo) {
  ScratchDirectory scratch;
  for (const bool close : {true, false}) {
    const auto expected = write_small(scratch / (close ? "x.mcap" : "y.mcap"), close);
    const std::string bytes = file_bytes(scratch / (close ? "x.mcap" : "y.mcap.part"));
    std::size_t most = 0;
    for (std::size_t size = 0; size < bytes.size(); ++size) {
      write_bytes(scratch / "cut", std::string_view(bytes).substr(0, size));
      if (size < mcap::kMagic.size()) {
        EXPECT_THROW(rows_of(scratch / "cut"), std::runtime_error) << size;
        continue;
      }
      McapFindings found;
      const auto rows = rows_of(scratch / "cut", &found);
      EXPECT_FALSE(found.complete) << size;
      EXPECT_FALSE(found.problems.empty()) << size;
      ASSERT_LE(rows.size(), expected.size());
      EXPECT_EQ(rows.size() % 5, 0u) << size;  // a chunk is whole or not there
      EXPECT_TRUE(std::equal(rows.begin(), rows.end(), expected.begin())) << size;
      EXPECT_GE(rows.size(), most) << size;  // more bytes never give less
      most = rows.size();
    }
    EXPECT_EQ(most, expected.size());
  }
}

TEST(McapReader, NoticesEveryFlippedBit) {
  ScratchDirectory scratch;
  const auto expected = write_small(scratch / "x.mcap", true);
  const std::string bytes = file_bytes(scratch / "x.mcap");
  std::fstream file(scratch / "x.mcap", std::ios::binary | std::ios::in | std::ios::out);
  const auto put_byte = [&](std::size_t at, char byte) {
    file.seekp(static_cast<std::streamoff>(at)).put(byte).flush();
  };
  for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    const std::size_t at = bit / 8;
    if (bit % 8 == 0 && bit > 0) put_byte(at - 1, bytes[at - 1]);
    put_byte(at, static_cast<char>(bytes[at] ^ (1 << (bit % 8))));
    McapFindings found;
    try {
      rows_of(scratch / "x.mcap", &found);
    } catch (const std::runtime_error&) {
      EXPECT_LT(at, mcap::kMagic.size());
      continue;
    }
    EXPECT_FALSE(found.complete) << "bit " << bit;
    EXPECT_FALSE(found.problems.empty()) << "bit " << bit;
    EXPECT_LE(found.messages, expected.size()) << "bit " << bit;
  }
}

TEST(McapReader, RefusesWhatIsNoRecording) {
  ScratchDirectory scratch;
  EXPECT_THROW(rows_of(scratch / "absent"), std::runtime_error);
  EXPECT_THROW(rows_of(scratch.path()), std::runtime_error);
  write_bytes(scratch / "text", "this is no recording at all");
  try {
    rows_of(scratch / "text");
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("is not an MCAP file"), std::string::npos);
  }
}

TEST(McapRecovery, MakesACompleteFileOfEveryTruncation) {
  ScratchDirectory scratch;
  write_small(scratch / "x.mcap", false);
  const std::string bytes = file_bytes(scratch / "x.mcap.part");
  for (std::size_t size = mcap::kMagic.size(); size <= bytes.size(); size += 7) {
    write_bytes(scratch / "cut.mcap.part", std::string_view(bytes).substr(0, size));
    McapFindings cut, whole;
    const auto expected = rows_of(scratch / "cut.mcap.part", &cut);
    EXPECT_EQ(recover_mcap(scratch / "cut.mcap.part", scratch / "cut.mcap").problems, cut.problems);
    EXPECT_EQ(rows_of(scratch / "cut.mcap", &whole), expected);
    EXPECT_TRUE(whole.complete) << size;
    EXPECT_EQ(whole.chunks, cut.chunks);
    EXPECT_THROW(recover_mcap(scratch / "cut.mcap.part", scratch / "cut.mcap"),
                 std::runtime_error);  // never overwrites
    std::filesystem::remove(scratch / "cut.mcap");
  }
  write_bytes(scratch / "text", "this is no recording at all");
  EXPECT_THROW(recover_mcap(scratch / "text", scratch / "text.mcap"), std::runtime_error);
  EXPECT_FALSE(std::filesystem::exists(scratch / "text.mcap"));
  EXPECT_FALSE(std::filesystem::exists(scratch / "text.mcap.recovering"));
}

}  // namespace
}  // namespace farhand
