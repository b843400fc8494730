// CSV and MAT level 4 against expectations written down by hand from the formats' descriptions.
#include "common/record/export.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <charconv>
#include <clocale>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "common/record/mcap_writer.hpp"
#include "common/record/recording.hpp"
#include "tests/support/scratch_directory.hpp"

namespace farhand {
namespace {

record::RunInfo info_of(const std::string& role) {
  record::RunInfo info;
  info.set_role(role);
  info.set_scene_name("wall");
  info.set_start_ns(2 * kSecond);
  return info;
}

std::filesystem::path record_link(const ScratchDirectory& scratch) {
  Recording recording(scratch / "netem.mcap", info_of("netem"));
  LinkSample sample;
  sample.asked_delay_s = 0.1;
  sample.achieved_delay_s = 0.10000000000000002;  // one step beside its neighbour: shortest text must keep both apart
  recording.write(2 * kSecond + 500 * kMillisecond, sample);
  sample.forward = false;
  sample.lost = true;
  sample.achieved_delay_s = std::numeric_limits<double>::infinity();
  recording.write(3 * kSecond, sample);
  recording.write(3 * kSecond, Note("said \"cut, now\""));
  recording.write(4 * kSecond, Note("ok"));
  return recording.finish({}).file;
}

TEST(ExportCsv, WritesWhatIsExpectedByteForByte) {
  ScratchDirectory scratch;
  const Exported exported = export_csv(record_link(scratch), scratch / "csv");
  EXPECT_TRUE(exported.problems.empty());
  EXPECT_EQ(exported.files.size(), 3u);
  EXPECT_EQ(file_bytes(scratch / "csv/netem.csv"),
            "t_s,t_ns,forward,lost,asked_delay_s,achieved_delay_s\n"
            "0.5,2500000000,1,0,0.1,0.10000000000000002\n"
            "1,3000000000,0,1,0.1,inf\n");
  EXPECT_EQ(file_bytes(scratch / "csv/events.csv"),
            "t_s,t_ns,who,text\n"
            "1,3000000000,\"netem\",\"said \"\"cut, now\"\"\"\n"
            "2,4000000000,\"netem\",\"ok\"\n");
  EXPECT_NE(file_bytes(scratch / "csv/info.txtpb").find("scene_name: \"wall\""), std::string::npos);
}

TEST(ExportCsv, MadeAgainHasANumberOfItsOwnAndLeavesTheFirstAlone) {
  ScratchDirectory scratch;
  const auto file = record_link(scratch);
  export_csv(file, scratch / "csv");
  write_bytes(scratch / "csv/netem.csv", "precious");
  const Exported again = export_csv(file, scratch / "csv");
  EXPECT_EQ(again.files, (std::vector<std::filesystem::path>{scratch / "csv/events-2.csv", scratch / "csv/netem-2.csv",
                                                             scratch / "csv/info-2.txtpb"}));
  EXPECT_EQ(file_bytes(scratch / "csv/netem.csv"), "precious");
  EXPECT_EQ(file_bytes(scratch / "csv/events-2.csv"), file_bytes(scratch / "csv/events.csv"));
  EXPECT_EQ(export_mat(file, scratch / "csv/netem.csv").files.at(0), scratch / "csv/netem-3.csv");
}

TEST(ExportCsv, LeavesACellEmptyWhereNothingIsKnown) {
  ScratchDirectory scratch;
  Recording recording(scratch / "slave.mcap", info_of("slave"));
  StationSample sample;
  sample.alpha = 0;
  sample.x_rad = -0.0;
  sample.true_x_rad = sample.true_v_rad_s = std::numeric_limits<double>::quiet_NaN();
  sample.true_f_nm = 0;
  recording.write(2 * kSecond, sample);
  export_csv(recording.finish({}).file, scratch / "csv");
  EXPECT_EQ(file_bytes(scratch / "csv/slave.csv"),
            "t_s,t_ns,state,x_rad,v_rad_s,f_nm,remote_x_rad,remote_v_rad_s,remote_f_nm,target_x_rad,command_nm,"
            "x_cdob_rad,alpha,playout_delay_s,rtt_s,limits,true_x_rad,true_v_rad_s,true_f_nm,newest_peer_send_ns,"
            "newest_peer_arrival_ns,energy_j,friction_nm,f_2_nm\n"
            "0,2000000000,0,-0,0,0,0,0,0,0,0,0,0,0,0,0,,,0,0,0,,,\n");
}

TEST(ExportCsv, ReadsBackAsTheSameDoubles) {
  ScratchDirectory scratch;
  Recording recording(scratch / "mcu.mcap", info_of("mcu"));
  std::mt19937_64 random(1);
  std::vector<double> values;
  for (int i = 0; i < 10'000; ++i) {
    double value = std::bit_cast<double>(random());  // any bit pattern: every exponent comes up
    if (!std::isfinite(value)) value = 1;
    values.push_back(value);
    McuSample sample;
    sample.spring_torque_nm = value;
    recording.write(2 * kSecond + i, sample);
  }
  const auto file = recording.finish({}).file;
  // A locale with a decimal comma, where the machine has one, must change nothing.
  for (const char* name : {"C", "de_DE.UTF-8", "fr_FR.UTF-8"}) {
    if (std::setlocale(LC_ALL, name) == nullptr) continue;
    export_csv(file, scratch / name);
    std::ifstream in(scratch / name / "mcu.csv");
    std::string line;
    std::getline(in, line);
    for (const double value : values) {
      ASSERT_TRUE(std::getline(in, line));
      ASSERT_EQ(std::count(line.begin(), line.end(), ','), 8);
      std::string_view cell(line);
      for (int i = 0; i < 6; ++i) cell.remove_prefix(cell.find(',') + 1);
      double read = 0;
      std::from_chars(cell.data(), cell.data() + cell.size(), read);
      ASSERT_EQ(std::bit_cast<std::uint64_t>(read), std::bit_cast<std::uint64_t>(value)) << line;
    }
  }
  std::setlocale(LC_ALL, "C");
}

// The bytes of a matrix as the description of MAT level 4 has them, put together with nothing of the exporter.
class Expected {
 public:
  void header(std::int32_t type, std::int32_t rows, std::int32_t columns, const char* name) {
    for (const std::int32_t field : {type, rows, columns, 0, static_cast<std::int32_t>(std::strlen(name)) + 1})
      raw(field);
    bytes_.append(name, std::strlen(name) + 1);
  }
  void doubles(std::initializer_list<double> values) {
    for (const double value : values) raw(value);
  }
  void text(const std::string& characters) { bytes_ += characters; }
  const std::string& bytes() const { return bytes_; }

 private:
  template <class T>
  void raw(T value) {
    static_assert(std::endian::native == std::endian::little);
    char copy[sizeof(T)];
    std::memcpy(copy, &value, sizeof(T));
    bytes_.append(copy, sizeof(T));
  }
  std::string bytes_;
};

TEST(ExportMat, WritesWhatIsExpectedByteForByte) {
  ScratchDirectory scratch;
  const Exported exported = export_mat(record_link(scratch), scratch / "netem.mat");
  EXPECT_EQ(exported.files.size(), 1u);
  Expected expected;
  expected.header(0, 2, 2, "events");
  expected.doubles({1, 2, 3e9, 4e9});
  expected.header(51, 2, 4, "events_columns");
  expected.text("tt__sn s");  // "t_s " over "t_ns", column by column
  expected.header(51, 2, 15, "events_text");
  expected.text(
      "soaki d   "
      "\" c u t ,   n o w \" ");  // woven of the two sentences, the shorter filled up
  expected.header(51, 2, 5, "events_who");
  expected.text("nneetteemm");
  expected.header(0, 2, 6, "netem");
  expected.doubles(
      {0.5, 1, 2.5e9, 3e9, 1, 0, 0, 1, 0.1, 0.1, 0.10000000000000002, std::numeric_limits<double>::infinity()});
  expected.header(51, 6, 16, "netem_columns");
  for (std::size_t i = 0; i < 16; ++i) {
    for (const char* name : {"t_s             ", "t_ns            ", "forward         ", "lost            ",
                             "asked_delay_s   ", "achieved_delay_s"}) {
      expected.text(std::string(1, name[i]));
    }
  }
  EXPECT_EQ(file_bytes(scratch / "netem.mat"), expected.bytes());
}

TEST(Export, TakesNoFileNameFromARecording) {
  ScratchDirectory scratch;
  McapWriter writer(scratch / "hostile.mcap");
  const auto info = writer.add_channel("/info", *record::RunInfo::descriptor());
  const auto outside = writer.add_channel("/../outside", *record::Event::descriptor());
  const auto other = writer.add_channel("/master", *record::LinkSample::descriptor());  // not what /master holds
  writer.write(info, 0, info_of("master").SerializeAsString());
  writer.write(outside, 1, "");
  writer.write(other, 2, "");
  writer.close();
  const Exported exported = export_csv(scratch / "hostile.mcap", scratch / "csv");
  EXPECT_EQ(exported.files, std::vector<std::filesystem::path>{scratch / "csv/info.txtpb"});
  ASSERT_EQ(exported.problems.size(), 1u);
  EXPECT_EQ(exported.problems[0], "hostile.mcap: 2 messages of a kind that is not known were left out");
  EXPECT_FALSE(std::filesystem::exists(scratch / "outside.csv"));
}

TEST(Export, SaysWhyItCannot) {
  ScratchDirectory scratch;
  const auto file = record_link(scratch);
  EXPECT_THROW(export_csv(scratch / "absent.mcap", scratch / "csv"), std::runtime_error);
  EXPECT_THROW(export_mat(file, "/nonexistent/x.mat"), std::runtime_error);
  EXPECT_THROW(export_csv(file, "/proc/csv"), std::runtime_error);
  McapWriter writer(scratch / "foreign.mcap");
  writer.close();
  EXPECT_THROW(export_csv(scratch / "foreign.mcap", scratch / "csv"), std::runtime_error);
}

TEST(Export, ReadsAnUnfinishedRecording) {
  ScratchDirectory scratch;
  {
    Recording recording(scratch / "mcu.mcap", info_of("mcu"));
    recording.write(2 * kSecond, McuSample{});
    recording.flush();
  }
  const Exported exported = export_csv(scratch / "mcu.mcap.part", scratch / "csv");
  EXPECT_EQ(exported.problems.size(), 1u);
  EXPECT_EQ(file_bytes(scratch / "csv/mcu.csv"),
            "t_s,t_ns,true_x_rad,true_v_rad_s,true_f_nm,motor_x_rad,spring_torque_nm,mcu_state,"
            "torque_command_nm\n0,2000000000,0,0,0,0,0,0,0\n");
}

}  // namespace
}  // namespace farhand
