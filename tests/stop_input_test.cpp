// The patient's stop that is read from a descriptor. (What the stations do with it is in timers_test.cpp.)
#include "common/runtime/stop_input.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#include <cstdlib>

#include "tests/support/pipe.hpp"
#include "tests/support/scratch_directory.hpp"

namespace farhand {
namespace {

TEST(StopInput, WithoutOneNothingIsEverPressed) {
  StopInput none("");
  EXPECT_FALSE(none.pressed());
  EXPECT_FALSE(none.broken());
}

TEST(StopInput, WhateverComesIsOnePressAndTheEndIsOneForGood) {
  Pipe pipe;
  StopInput input("fd:" + std::to_string(pipe.out()));
  for (int i = 0; i < 3; ++i) {
    EXPECT_FALSE(input.pressed());
    pipe.say(std::string(700, 'x'));
    EXPECT_TRUE(input.pressed());
  }
  EXPECT_FALSE(input.pressed());
  EXPECT_FALSE(input.broken());
  pipe.finish();
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(input.pressed());
  EXPECT_TRUE(input.broken());
}

TEST(StopInput, APressBeforeTheStartCounts) {
  Pipe pipe;
  pipe.say("x");
  StopInput input("fd:" + std::to_string(pipe.out()));
  EXPECT_TRUE(input.pressed());
  EXPECT_FALSE(input.pressed());
}

TEST(StopInput, AFileIsPressedWhileItIsNotAsAtTheStartAndForGoodWhenItIsGone) {
  ScratchDirectory scratch;
  const auto file = scratch / "value";
  write_bytes(file, "0\n");
  StopInput input(file.string());
  EXPECT_FALSE(input.pressed());
  write_bytes(file, "1\n");
  EXPECT_TRUE(input.pressed());
  EXPECT_TRUE(input.pressed());
  write_bytes(file, "0\n");
  EXPECT_FALSE(input.pressed());
  std::filesystem::resize_file(file, 0);
  EXPECT_TRUE(input.pressed());
  write_bytes(file, "0\n");
  EXPECT_TRUE(input.pressed());
  EXPECT_TRUE(input.broken());
}

TEST(StopInput, ANamedPipeIsHeardAndItsWriterMustBeThere) {
  ScratchDirectory scratch;
  const std::string path = (scratch / "pedal").string();
  ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
  EXPECT_THROW(StopInput{path}, std::runtime_error);
  const int pedal = open(path.c_str(), O_RDWR);
  StopInput input(path);
  EXPECT_FALSE(input.pressed());
  ASSERT_EQ(write(pedal, "x", 1), 1);
  EXPECT_TRUE(input.pressed());
  EXPECT_FALSE(input.pressed());
  close(pedal);
  EXPECT_TRUE(input.pressed());
  EXPECT_TRUE(input.broken());
}

// A pedal on a serial line, as a pseudo terminal of another session: no key of it is kept for a whole line, and none is
// a signal.
TEST(StopInput, EachByteOfASerialLineIsAPressAndSoIsItsHangUp) {
  const int pedal = posix_openpt(O_RDWR | O_NOCTTY);
  ASSERT_EQ(grantpt(pedal), 0);
  ASSERT_EQ(unlockpt(pedal), 0);
  const std::string path = ptsname(pedal);
  const int held = open(path.c_str(), O_RDWR | O_NOCTTY);
  termios before{}, after{};
  tcgetattr(held, &before);
  {
    StopInput input(path);
    EXPECT_FALSE(input.pressed());
    for (int byte = 0; byte < 256; ++byte) {
      const char c = static_cast<char>(byte);
      ASSERT_EQ(write(pedal, &c, 1), 1);
      bool pressed = false;
      for (int i = 0; i < 10'000 && !pressed; ++i) {
        pressed = input.pressed();
        if (!pressed) usleep(1000);
      }
      ASSERT_TRUE(pressed) << byte;
    }
    EXPECT_FALSE(input.pressed());
  }
  tcgetattr(held, &after);
  EXPECT_EQ(after.c_lflag, before.c_lflag);
  EXPECT_EQ(after.c_iflag, before.c_iflag);
  StopInput input(path);
  EXPECT_FALSE(input.pressed());
  close(pedal);
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(input.pressed());
  EXPECT_TRUE(input.broken());
  close(held);
}

TEST(StopInput, RefusesWhatNobodyCouldStopBy) {
  ScratchDirectory scratch;
  write_bytes(scratch / "empty", "");
  Pipe ended;
  ended.finish();
  const std::pair<std::string, std::string> wrong[] = {{(scratch / "missing").string(), "No such file"},
                                                       {scratch.path().string(), "directory"},
                                                       {(scratch / "empty").string(), "empty"},
                                                       {"/dev/null", "ended"},
                                                       {"fd:" + std::to_string(ended.out()), "ended"},
                                                       {"fd:1000", "Bad file descriptor"},
                                                       {"fd:", "not fd:N"},
                                                       {"fd:3x", "not fd:N"},
                                                       {"fd:-1", "not fd:N"},
                                                       {"fd:0", "operator's keys"}};
  for (const auto& [what, why] : wrong) {
    try {
      StopInput input(what);
      ADD_FAILURE() << what;
    } catch (const std::runtime_error& error) {
      EXPECT_NE(std::string(error.what()).find("patient's stop"), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find(why), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace farhand
