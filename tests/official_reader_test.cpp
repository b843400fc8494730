// The official MCAP reader reads our complete files: through the index, from front to back, checksums verified,
// messages decoded by the schema in the file alone. Needs node and npm; fetches the reader once per build directory.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "common/config/json.hpp"
#include "common/record/mcap_reader.hpp"
#include "common/record/recorder.hpp"
#include "common/record/session_file.hpp"
#include "tests/support/scratch_directory.hpp"

namespace farhand {
namespace {

const std::filesystem::path kSource = std::filesystem::path(FARHAND_TEST_DIR) / "mcap_reader_check";
const std::filesystem::path kInstalled = FARHAND_CHECK_DIR;

int shell(const std::string& command) { return std::system(command.c_str()); }

// Installs what the lock file names, unless exactly that stands there already.
void install() {
  std::filesystem::create_directories(kInstalled);
  const bool same = std::filesystem::exists(kInstalled / "node_modules/@mcap/core") &&
                    file_bytes(kInstalled / "package-lock.json") == file_bytes(kSource / "package-lock.json");
  for (const char* name : {"package.json", "package-lock.json", "check.mjs"}) {
    std::filesystem::copy_file(kSource / name, kInstalled / name, std::filesystem::copy_options::overwrite_existing);
  }
  if (same) return;
  const std::string log = (kInstalled / "npm.log").string();
  const std::string command =
      "cd '" + kInstalled.string() + "' && npm ci --ignore-scripts --no-audit --no-fund >npm.log 2>&1";
  ASSERT_EQ(shell(command), 0) << command << "\n" << file_bytes(log);
}

Json read_officially(const ScratchDirectory& scratch, const std::string& files) {
  const std::string out = (scratch / "out.json").string();
  EXPECT_EQ(shell("cd '" + scratch.path().string() + "' && node '" + (kInstalled / "check.mjs").string() + "' " +
                  files + " >'" + out + "' 2>&1"),
            0)
      << file_bytes(out);
  return Json::parse(file_bytes(out));
}

TEST(OfficialReader, ReadsCompleteRecoveredAndMergedFiles) {
  if (shell("node --version >/dev/null 2>&1") != 0 || shell("npm --version >/dev/null 2>&1") != 0) {
    GTEST_SKIP() << "OfficialReader needs node and npm; one of them is missing";
  }
  ASSERT_NO_FATAL_FAILURE(install());

  ScratchDirectory scratch;
  constexpr int kCount = 5000;
  record::RunInfo info;
  info.set_role("master");
  info.set_scene_name("wall");
  info.set_start_ns(3 * kSecond);
  const auto record_into = [&](Recording& recording) {
    for (int i = 0; i < kCount; ++i) {
      StationSample sample;
      sample.state = 2;
      sample.x_rad = 0.25 + i;
      sample.true_x_rad = std::nan("");
      sample.true_f_nm = -1.5;
      recording.write(3 * kSecond + i * kMillisecond, sample);
      if (i == 1000) recording.write(4 * kSecond, Note("contact"));
    }
  };
  Recording recording(scratch / "master.mcap", info);
  record_into(recording);
  ASSERT_EQ(recording.finish({}).problem, "");
  {
    Recording killed(scratch / "killed.mcap", info);
    record_into(killed);
  }
  recover_mcap(scratch / "killed.mcap.part", scratch / "killed.mcap");
  Session session;
  session.scene_name = "wall";
  session.master.resize(10'000);
  session.slave.resize(7);
  for (std::size_t i = 0; i < session.master.size(); ++i) session.master[i].t_s = 1e-3 * static_cast<double>(i);
  write_session_mcap(session, scratch / "session.mcap");

  const Json seen = read_officially(scratch, "master.mcap killed.mcap session.mcap");
  ASSERT_TRUE(seen.is_object());
  for (const char* name : {"master.mcap", "killed.mcap"}) {
    const Json file = seen[name];
    EXPECT_EQ(file["topics"]["/master"]["count"], kCount);
    EXPECT_EQ(file["topics"]["/events"]["count"], 1);
    EXPECT_EQ(file["topics"]["/events"]["first"]["text"], "contact");
    EXPECT_EQ(file["topics"]["/events"]["first"]["who"], "master");
    EXPECT_EQ(file["topics"]["/info"]["first"]["scene_name"], "wall");
    const Json last = file["topics"]["/master"]["last"];
    EXPECT_EQ(last["t_ns"], "7999000000");
    EXPECT_EQ(last["x_rad"], 4999.25);
    EXPECT_EQ(last["state"], 2);
    EXPECT_EQ(last["true_f_nm"], -1.5);
    EXPECT_FALSE(last.contains("true_x_rad"));
    EXPECT_EQ(file["ordered"], true);
    EXPECT_EQ(file["statistics"]["messageStartTime"], "3000000000");
    EXPECT_EQ(file["statistics"]["messageEndTime"], "7999000000");
    const bool killed = std::string(name) == "killed.mcap";
    EXPECT_EQ(file["streamed"], kCount + (killed ? 2 : 3));  // a killed process wrote no counters
    EXPECT_EQ(file["statistics"]["messageCount"], std::to_string(kCount + (killed ? 2 : 3)));
  }
  EXPECT_EQ(seen["session.mcap"]["topics"]["/master"]["count"], 10'000);
  EXPECT_EQ(seen["session.mcap"]["topics"]["/slave"]["count"], 7);
  EXPECT_EQ(seen["session.mcap"]["streamed"], 10'008);
}

}  // namespace
}  // namespace farhand
