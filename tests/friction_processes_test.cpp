// The friction of the patient's device as a user of the programs meets it: what the box says of its file, and a sweep
// on the emulated orthosis whose result is in the file at once.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>

#include <chrono>
#include <cmath>
#include <ctime>
#include <fstream>
#include <sstream>

#include "common/runtime/friction_file.hpp"
#include "common/station/states.hpp"
#include "tests/support/scratch_directory.hpp"
#include "tests/support/session_processes.hpp"

namespace farhand {
namespace {

std::int64_t now_utc_s() { return std::time(nullptr); }

std::string text_in(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

struct Ended {
  int code;
  std::string said;
};

// A box without a peer, for a tenth of a second.
Ended box(const std::vector<std::string>& more) {
  std::vector<std::string> command{path_of(Program::kSlave),
                                   "--scene",
                                   "zero_delay",
                                   "--insecure",
                                   "--peer",
                                   "127.0.0.1:9",
                                   "--quiet",
                                   "--set",
                                   "windows={}",
                                   "--set",
                                   "duration_s=0.1",
                                   "--set",
                                   "slave.hand={}"};
  command.insert(command.end(), more.begin(), more.end());
  ChildProcess slave(command);
  const int code = slave.wait();
  return {code, slave.err()};
}

TEST(FrictionProcesses, TheBoxSaysAtTheStartWhatItTakesAndWhy) {
  ScratchDirectory scratch;
  const std::string file = (scratch / "friction").string();
  const Ended without = box({});
  EXPECT_EQ(without.code, 0) << without.said;
  EXPECT_NE(without.said.find("without --friction FILE nothing is known of the friction of this device: 0.1 N m is "
                              "taken as threshold of a contact, because"),
            std::string::npos)
      << without.said;

  const Ended none = box({"--friction", file});
  EXPECT_EQ(none.code, 0) << none.said;
  EXPECT_NE(none.said.find("never measured: 0.100 N m is assumed"), std::string::npos) << none.said;
  EXPECT_FALSE(std::filesystem::exists(file)) << "nothing was measured";

  add_friction(file, {now_utc_s() - 200'000, 0.04, 0.001});
  const std::string before = text_in(file);
  const Ended old = box({"--friction", file});
  EXPECT_EQ(old.code, 0) << old.said;
  EXPECT_NE(old.said.find("more than a day ago: 1.5 times its 0.0400 N m is assumed"), std::string::npos) << old.said;
  EXPECT_EQ(text_in(file), before);

  add_friction(file, {now_utc_s() - 60, 0.05, 0.002});
  const Ended good = box({"--friction", file});
  EXPECT_EQ(good.code, 0) << good.said;
  EXPECT_NE(good.said.find("is 0.0500 N m (spread 0.0020 N m), measured on 20"), std::string::npos) << good.said;
}

TEST(FrictionProcesses, AFileThatCannotBeReadOrKeptEndsTheBoxWithASentence) {
  ScratchDirectory scratch;
  const std::filesystem::path file = scratch / "friction";
  const auto refused = [&](const std::string& text, const std::string& sentence) {
    std::ofstream(file) << text;
    ::chmod(file.c_str(), 0600);
    const Ended ended = box({"--friction", file.string()});
    EXPECT_EQ(ended.code, 2) << text;
    EXPECT_NE(ended.said.find(file.string() + ": " + sentence), std::string::npos) << ended.said;
    EXPECT_EQ(text_in(file), text) << "nothing is overwritten";
  };
  const std::string good = "2026-12-01T09:30:00Z friction_nm 0.05 spread_nm 0.001\n";
  refused(good + "hello\n", "line 2: must be a date, the friction and its spread in N m");
  refused(good + "2026-12-01T09:31:00Z friction_nm 0.7 spread_nm 0.001\n",
          "line 2: friction_nm = 0.7: must be from 0 to 0.5 N m");
  refused("2026-12-01T09:31:00Z friction_nm 0.1 spread_nm -1\n", "line 1: spread_nm = -1: must be from 0 to 0.5 N m");
  const std::string nowhere = (scratch / "no directory" / "friction").string();
  const Ended ended = box({"--friction", nowhere});
  EXPECT_EQ(ended.code, 2) << ended.said;
  EXPECT_NE(ended.said.find("friction file " + nowhere + ": no result could be kept"), std::string::npos) << ended.said;
  EXPECT_EQ(box({"--friction", scratch.path().string()}).code, 2);
  EXPECT_EQ(box({"--friction", ""}).code, 2);
}

// The hand is put into the device after the first sweep, so that the second one is refused.
TEST(NightlyFrictionProcesses, ASweepIsInTheFileAtOnceAndARefusedOneLosesNothing) {
  ScratchDirectory scratch;
  const std::filesystem::path file = scratch / "friction";
  add_friction(file, {now_utc_s() - 200'000, 0.04, 0.001});
  const std::string before = text_in(file);
  const std::int64_t from_s = now_utc_s();
  SessionOptions options{
      .scene = "sea_four_channel_mediated",
      .sets = {"windows={}", "duration_s=600", "slave.hand={stiffness_nm_per_rad: 2 from_s: 60}",
               "slave.series_elastic.tendon_friction_nm=0.05", "operator_acts[0]={at_s: 0.2 act: RESET}"},
      .preloads = {},
      .station_environment = {},
      .slave_arguments = {"--friction", file.string()}};
  SessionProcesses session(scratch.path(), options);
  ChildProcess& slave = session[Program::kSlave];
  const auto is_now = [&](StationState state) {
    const Recorded recorded = session.recorded(Program::kSlave);
    return !recorded.slave.empty() && recorded.slave.back().second.state == static_cast<int>(state);
  };
  ASSERT_TRUE(comes_true([&] { return is_now(StationState::kReady); })) << slave.err();
  slave.say("friction\n");
  ASSERT_TRUE(comes_true([&] { return is_now(StationState::kSweeping); })) << slave.err();
  ASSERT_TRUE(comes_true([&] { return text_in(file) != before; }, 120)) << slave.err();
  ASSERT_TRUE(slave.running()) << "in the file while the session goes on";
  const std::string after = text_in(file);
  EXPECT_TRUE(after.starts_with(before)) << after;
  const auto last = load_friction(file);
  ASSERT_TRUE(last);
  EXPECT_NEAR(last->F_c, 0.05, 0.01);
  EXPECT_GE(last->utc_s, from_s);
  EXPECT_LE(last->utc_s, now_utc_s());

  ASSERT_TRUE(comes_true([&] {
    const Recorded recorded = session.recorded(Program::kSlave);
    return to_seconds(recorded.slave.back().first - recorded.slave.front().first) > 62;
  })) << slave.err();
  slave.say("friction\n");
  ASSERT_TRUE(comes_true([&] { return is_now(StationState::kFault); }, 120)) << slave.err();
  EXPECT_EQ(text_in(file), after);
  session.stop();
  EXPECT_EQ(text_in(file), after);
  const record::RunInfo info = session.recorded(Program::kSlave).info;
  EXPECT_TRUE(info.friction().measured());
  EXPECT_NEAR(info.friction().f_c_nm(), last->F_c, 1e-4);
  EXPECT_EQ(info.friction().threshold_nm(), info.friction().f_c_nm());
  EXPECT_EQ(info.friction().swept_utc_s(), last->utc_s);
  std::printf("%s%s", after.c_str(), slave.err().c_str());
}

}  // namespace
}  // namespace farhand
