// What the programs do to files that are there: nothing. Killed and started again, pointed at devices, keys and each
// other's files, on a disk that is full, under any umask.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>

#include "common/files/output.hpp"
#include "common/record/mcap_reader.hpp"
#include "tests/support/scratch_directory.hpp"
#include "tests/support/session_processes.hpp"

namespace farhand {
namespace {

namespace fs = std::filesystem;
using Arguments = std::vector<std::string>;

constexpr const char* kNobody = "127.0.0.1:9";  // the discard service, which nobody runs

// A box that waits for its peer, and records meanwhile.
Arguments box(const fs::path& record) {
  return {path_of(Program::kSlave), "--insecure", "--scene", "outage", "--peer", kNobody, "--quiet", "--record",
          record.string()};
}

Arguments through_shell(const std::string& before, const Arguments& command) {
  Arguments all{"/bin/sh", "-c", before + "; exec \"$0\" \"$@\""};
  all.insert(all.end(), command.begin(), command.end());
  return all;
}

std::uint64_t messages_in(const fs::path& recording) {
  try {
    return read_mcap(recording, [](const McapMessage&) {}).messages;
  } catch (const std::runtime_error&) {
    return 0;  // not there, or not begun
  }
}

struct Ended {
  int code;
  std::string out, err;
};
Ended run(const Arguments& command) {
  ChildProcess child(command, slave_environment());
  const int code = child.wait();
  return {code, child.out(), child.err()};
}
Ended lab(Arguments arguments) {
  arguments.insert(arguments.begin(), FARHAND_LAB);
  return run(arguments);
}

// To its end, whatever the verdict.
bool ran(const Ended& ended) { return ended.code == 0 || ended.code == 3; }

mode_t mode_of(const fs::path& file) {
  struct stat info {};
  EXPECT_EQ(::lstat(file.c_str(), &info), 0) << file;
  return info.st_mode & 07777;
}

void expect_private(const fs::path& root) {
  EXPECT_EQ(mode_of(root), mode_t{0700}) << root;
  for (const auto& entry : fs::recursive_directory_iterator(root)) {
    EXPECT_EQ(mode_of(entry.path()), entry.is_directory() ? mode_t{0700} : mode_t{0600}) << entry.path();
  }
}

TEST(KeptFiles, TwentyKillsAndRestartsAreTwentyRecordings) {
  ScratchDirectory scratch;
  for (int run = 1; run <= 20; ++run) {
    const fs::path part = numbered(scratch / "slave.mcap", run).string() + ".part";
    ChildProcess killed(box(scratch / "slave.mcap"), slave_environment());
    ASSERT_TRUE(comes_true([&] { return messages_in(part) > 10; })) << killed.err();
    killed.send_signal(SIGKILL);
    killed.wait();
    EXPECT_EQ(killed.err().find("of a run that did not end") != std::string::npos, run > 1) << killed.err();
    EXPECT_EQ(killed.err().find("slave.mcap.part is of a run") != std::string::npos, run > 1) << killed.err();
  }
  for (int run = 1; run <= 20; ++run) {
    const fs::path whole = numbered(scratch / "slave.mcap", run), part = whole.string() + ".part";
    const std::uint64_t there = messages_in(part);
    const Ended recovered = lab({"recording", "recover", part.string()});
    EXPECT_EQ(recovered.code, 0) << recovered.err;
    const McapFindings found = read_mcap(whole, [](const McapMessage&) {});
    EXPECT_TRUE(found.complete);
    EXPECT_EQ(found.messages, there);
    EXPECT_GT(there, 10u);
    EXPECT_EQ(mode_of(whole), mode_t{0600});
    const Ended again = lab({"recording", "recover", part.string()});
    EXPECT_EQ(again.code, 2);
    EXPECT_NE(again.err.find("exists already: say another name as TO"), std::string::npos) << again.err;
  }
}

TEST(KeptFiles, ARecordingGoesToNewRegularFilesOnly) {
  ScratchDirectory scratch;
  const std::string scene = (scratch / "scene.txtpb").string(), key = (scratch / "key").string();
  ASSERT_EQ(run({path_of(Program::kSlave), "pair", "--key", key}).code, 0);
  write_bytes(scene, "architecture: FOUR_CHANNEL\nduration_s: 1\nslave { device: DIRECT_DRIVE }\n");
  fs::create_hard_link(scene, scratch / "same.txtpb");
  fs::create_directory(scratch / "directory");
  fs::create_symlink("/dev/null", scratch / "to_null");
  const std::string key_text = file_bytes(key), scene_text = file_bytes(scene);
  struct stat null_before {
  }, null_after{};
  ASSERT_EQ(::stat("/dev/null", &null_before), 0);

  const auto refused = [&](const std::string& record, const std::string& says) {
    const Arguments common{"--scene", scene, "--record", record};
    for (const Arguments& one :
         {Arguments{path_of(Program::kMaster), "--key", key, "--listen", "127.0.0.1:0"},
          Arguments{path_of(Program::kSlave), "--key", key, "--peer", kNobody},
          Arguments{path_of(Program::kNetem), "--listen", "127.0.0.1:0", "--forward", kNobody}}) {
      if (record == key && one[0] == path_of(Program::kNetem)) continue;  // it knows of no key
      Arguments command = one;
      command.insert(command.end(), common.begin(), common.end());
      const Ended ended = run(command);
      EXPECT_EQ(ended.code, 2) << ended.err;
      EXPECT_NE(ended.err.find(says), std::string::npos) << ended.err;
      EXPECT_EQ(ended.out, "") << "it must not announce itself first";
    }
  };
  refused("/dev/null", "cannot write /dev/null: it is a device");
  refused((scratch / "to_null").string(), "it is a device");
  refused((scratch / "directory").string(), "it is a directory");
  refused((scratch / "none/x.mcap").string(), "No such file");
  refused(key, "is the same file as --key");
  refused(scene, "is the same file as --scene");
  refused((scratch / "same.txtpb").string(), "is the same file as --scene");
  ASSERT_EQ(::stat("/dev/null", &null_after), 0);
  EXPECT_EQ(null_before.st_ino, null_after.st_ino);
  EXPECT_TRUE(S_ISCHR(null_after.st_mode));

  // A key that the command does not use is a file like others: kept, and the recording goes beside it.
  ChildProcess beside(box(key), slave_environment());
  ASSERT_TRUE(comes_true([&] { return messages_in(key + "-2.part") > 10; })) << beside.err();
  beside.send_signal(SIGTERM);
  EXPECT_EQ(beside.wait(), 130);
  EXPECT_NE(beside.err().find(key + " exists already and stays as it is: " + key + "-2 is written instead"),
            std::string::npos)
      << beside.err();
  EXPECT_TRUE(read_mcap(key + "-2", [](const McapMessage&) {}).complete);
  EXPECT_EQ(file_bytes(key), key_text);
  EXPECT_EQ(file_bytes(scene), scene_text);
}

// A limit on the size of files, which ends a program that does not expect it, is a full disk to the box. There is room
// for more than a second, so that whole chunks are in it however seldom a busy host lets the recorder write.
TEST(KeptFiles, TheBoxGoesOnWhereNothingCanBeWrittenAnyMore) {
  ScratchDirectory scratch;
  ChildProcess limited(through_shell("ulimit -f 400", box(scratch / "slave.mcap")), slave_environment());
  const fs::path part = scratch / "slave.mcap.part";
  ASSERT_TRUE(comes_true([&] { return limited.err().find("the session goes on") != std::string::npos; }))
      << limited.err();
  EXPECT_NE(limited.err().find("recording: " + part.string() + ": File too large"), std::string::npos) << limited.err();
  ::usleep(500'000);
  EXPECT_TRUE(limited.running());
  limited.send_signal(SIGTERM);
  EXPECT_EQ(limited.wait(), 130);
  EXPECT_NE(limited.err().find("found no room on the disk"), std::string::npos) << limited.err();
  const McapFindings found = recover_mcap(part, scratch / "recovered.mcap");
  EXPECT_GT(found.messages, 10u);
  EXPECT_TRUE(read_mcap(scratch / "recovered.mcap", [](const McapMessage&) {}).complete);
}

TEST(KeptFiles, TheBoxGoesOnWhenNobodyReadsItsOutput) {
  ScratchDirectory scratch;
  const std::string pid = (scratch / "pid").string(), code = (scratch / "code").string();
  Arguments loud = box(scratch / "slave.mcap");
  loud.erase(std::find(loud.begin(), loud.end(), "--quiet"));
  Arguments shell{"/bin/sh", "-c",
                  "{ \"$@\" & echo $! >" + pid + "; wait $!; echo $? >" + code + "; } | true; while [ ! -s " + code +
                      " ]; do sleep 0.02; done",
                  "sh"};
  shell.insert(shell.end(), loud.begin(), loud.end());
  ChildProcess piped(shell, slave_environment());
  ASSERT_TRUE(comes_true([&] { return messages_in(scratch / "slave.mcap.part") > 1500; })) << piped.err();
  ::kill(std::stoi(file_bytes(pid)), SIGTERM);
  EXPECT_EQ(piped.wait(), 0) << piped.err();
  EXPECT_EQ(file_bytes(code), "130\n") << piped.err();
  EXPECT_TRUE(read_mcap(scratch / "slave.mcap", [](const McapMessage&) {}).complete);
}

TEST(KeptFiles, ResultsAreForTheirOwnerAndAReportMadeAgainIsASecondOne) {
  ScratchDirectory scratch;
  const auto in_scratch = [&](const Arguments& command) {
    return run(through_shell("umask 0; cd " + scratch.path().string(), command));
  };
  const Ended made = in_scratch({FARHAND_LAB, "directory", "zero_delay"});
  ASSERT_EQ(made.code, 0) << made.err;
  const fs::path directory = scratch / made.out.substr(0, made.out.find(' '));
  expect_private(scratch / "sessions");
  ASSERT_TRUE(ran(in_scratch({FARHAND_LAB, "run", "zero_delay", "--record", (directory / "master.mcap").string(),
                              "--json", (directory / "m.json").string(), "--csv", (directory / "m.csv").string(),
                              "--report", (directory / "m.html").string()})));
  for (const char* number : {"", "-2", "-3"}) {
    const Ended reported = in_scratch({FARHAND_LAB, "report", directory.string()});
    EXPECT_TRUE(ran(reported)) << reported.err;
    const std::string html = (directory / ("report" + std::string(number) + ".html")).string();
    EXPECT_NE(reported.out.find(html), std::string::npos) << reported.out;
    for (const std::string name : {"report", "summary", "session"}) {
      const char* extension = name == "report" ? ".html" : name == "summary" ? ".json" : ".mcap";
      EXPECT_TRUE(fs::exists(directory / (name + number + extension))) << name << number;
    }
  }
  ASSERT_EQ(in_scratch({FARHAND_LAB, "recording", "export", (directory / "master.mcap").string(), "--csv",
                        (directory / "tables/csv").string(), "--mat", (directory / "m.mat").string()})
                .code,
            0);
  ASSERT_EQ(in_scratch({path_of(Program::kSlave), "pair", "--key", (directory / "keys/of/key").string()}).code, 0);
  expect_private(scratch / "sessions");
}

TEST(KeptFiles, AnExperimentThatIsStoppedKeepsTheLinesThatAreComplete) {
  ScratchDirectory scratch;
  const std::string json = (scratch / "lines.json").string();
  ChildProcess lab({FARHAND_LAB, "endure", "zero_delay", "--hours", "1000", "--line", "1", "--json", json});
  for (int line = 0; line < 4; ++line) ASSERT_FALSE(lab.read_line().empty()) << lab.err();  // two of them the head
  lab.send_signal(SIGINT);
  EXPECT_EQ(lab.wait(), 130) << lab.err();
  EXPECT_NE(lab.err().find("of 3600000 virtual seconds; the lines above are complete"), std::string::npos) << lab.err();
  const std::string text = file_bytes(json);
  std::size_t lines = 0;
  for (std::size_t at = 0; (at = text.find("\"until_s\"", at)) != std::string::npos; ++at) ++lines;
  EXPECT_GE(lines, 2u);
  EXPECT_TRUE(text.ends_with("}\n")) << text;
}

TEST(KeptFiles, WhatIsReadIsNeverWrittenAndTwoResultsHaveTwoNames) {
  ScratchDirectory scratch;
  const std::string file = (scratch / "x.mcap").string(), scene = (scratch / "x.txtpb").string();
  ASSERT_TRUE(ran(lab({"run", "zero_delay", "--record", file})));
  write_bytes(scene, "architecture: FOUR_CHANNEL\nduration_s: 1\n");
  const std::string before = file_bytes(file);
  const auto refused = [](const Arguments& arguments, const std::string& says) {
    const Ended ended = lab(arguments);
    EXPECT_EQ(ended.code, 2) << ended.err;
    EXPECT_NE(ended.err.find(says), std::string::npos) << ended.err;
  };
  refused({"recording", "export", file, "--mat", file}, "is the same file as FILE");
  refused({"recording", "recover", file, file}, "is the same file as FILE");
  refused({"identify", file, "--json", file}, "is the same file as FILE");
  refused({"run", scene, "--json", scene}, "is the same file as SCENE");
  refused({"run", scene, "--json", file + ".a", "--csv", file + ".a"}, "each needs one of its own");
  refused({"run", scene, "--report", "/dev/null"}, "it is a device");
  refused({"run", scene, "--record", scratch.path().string()}, "it is a directory");
  refused({"recording", "export", file, "--csv", file}, "is the same file as FILE");
  EXPECT_EQ(file_bytes(file), before);
  EXPECT_FALSE(fs::exists(file + ".a")) << "refused before anything ran";
}

TEST(KeptFiles, AnArgumentThatIsNoUtf8IsRefused) {
  ScratchDirectory scratch;
  const std::string scene = (scratch / "caf\xe9.txtpb").string();
  write_bytes(scene, "architecture: FOUR_CHANNEL\nduration_s: 1\nslave { device: DIRECT_DRIVE }\n");
  Arguments command = box(scratch / "slave.mcap");
  *(std::find(command.begin(), command.end(), "--scene") + 1) = scene;
  for (const Ended& ended : {run(command), lab({"run", scene}), lab({"report", scene}),
                             run({path_of(Program::kMaster), "pair", "--key", scene})}) {
    EXPECT_EQ(ended.code, 2);
    EXPECT_NE(ended.err.find("caf\\xe9.txtpb' is not UTF-8"), std::string::npos) << ended.err;
  }
  EXPECT_FALSE(fs::exists(scratch / "slave.mcap.part"));
}

}  // namespace
}  // namespace farhand
