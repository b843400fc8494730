// The command line: an option that is alone takes no other.
#include "common/runtime/command.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace farhand {
namespace {

struct Ended {
  int code;
  std::string err;
};

Ended run(std::vector<std::string> arguments) {
  std::string row, json;
  int sessions = 1;
  Program program("farhand-it", "for this test");
  Command command = program.command();
  command.text("--replay", row, "a row");
  command.count("--sessions", sessions, 1, 9, "sessions");
  command.text("--json", json, "results");
  command.alone("--replay");
  std::string name = "farhand-it";
  std::vector<char*> argv{name.data()};
  for (std::string& argument : arguments) argv.push_back(argument.data());
  testing::internal::CaptureStderr();
  const int code = program.run(static_cast<int>(argv.size()), argv.data(), [] { return kExitOk; });
  return {code, testing::internal::GetCapturedStderr()};
}

TEST(CommandLine, AnOptionThatIsAloneRefusesEveryOther) {
  EXPECT_EQ(run({"--replay", "row"}).code, kExitOk);
  EXPECT_EQ(run({"--json", "x", "--sessions", "2"}).code, kExitOk);
  for (const std::vector<std::string>& other : {std::vector<std::string>{"--json", "x"}, {"--sessions", "2"}}) {
    for (const bool before : {false, true}) {
      std::vector<std::string> arguments{"--replay", "row"};
      arguments.insert(before ? arguments.begin() : arguments.end(), other.begin(), other.end());
      const Ended ended = run(arguments);
      EXPECT_EQ(ended.code, kExitUsage);
      EXPECT_NE(ended.err.find("--replay"), std::string::npos) << ended.err;
      EXPECT_NE(ended.err.find(other.front()), std::string::npos) << ended.err;
    }
  }
}

}  // namespace
}  // namespace farhand
