// The real serial library over a pseudo terminal: what is sent arrives, a pulled cable is noticed, refusals name the
// remedy.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/ioctl.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include "common/device/pty.hpp"
#include "common/device/serial_port.hpp"
#include "tests/support/alloc_counter.hpp"
#include "tests/support/pty_preload.hpp"

namespace farhand {
namespace {

namespace fs = std::filesystem;

class Serial : public testing::Test {
 protected:
  Serial() {
    char name[] = "/tmp/farhand_serial_XXXXXX";
    directory_ = mkdtemp(name);
    link_ = directory_ + "/mcu";
  }
  ~Serial() override { fs::remove_all(directory_); }

  std::string directory_, link_;
};

std::string refusal(const std::string& path) {
  try {
    const SerialPort port(path);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "opened";
}

// Waiting is bounded by tries, not by a deadline on the result.
template <class End>
std::vector<std::uint8_t> read_all(End& end, std::size_t size) {
  std::vector<std::uint8_t> all;
  std::uint8_t buffer[64];
  for (int i = 0; i < 5000 && all.size() < size; ++i) {
    const std::size_t got = end.read(buffer);
    all.insert(all.end(), buffer, buffer + got);
    if (got == 0) usleep(1000);
  }
  return all;
}

std::vector<std::uint8_t> every_byte() {
  std::vector<std::uint8_t> bytes(256);
  std::iota(bytes.begin(), bytes.end(), std::uint8_t{0});
  return bytes;
}

TEST_F(Serial, EveryByteArrivesUnchangedInBothDirections) {
  Pty board(link_);
  SerialPort port(link_);
  const auto bytes = every_byte();
  EXPECT_EQ(port.write(bytes), bytes.size());
  EXPECT_EQ(read_all(board, bytes.size()), bytes);
  EXPECT_EQ(board.write(bytes), bytes.size());
  EXPECT_EQ(read_all(port, bytes.size()), bytes);
  EXPECT_FALSE(port.lost());
  EXPECT_EQ(port.counters().bytes_written, 256u);
  EXPECT_EQ(port.counters().bytes_read, 256u);
}

TEST_F(Serial, AnIdleLineGivesNothingAndIsNotLost) {
  Pty board(link_);
  SerialPort port(link_);
  std::uint8_t buffer[8];
  for (int i = 0; i < 1000; ++i) EXPECT_EQ(port.read(buffer), 0u);
  EXPECT_EQ(port.read({}), 0u);
  EXPECT_EQ(port.write({}), 0u);
  EXPECT_FALSE(port.lost());
}

TEST_F(Serial, AFullOutputBufferIsCountedAndNoError) {
  Pty board(link_);
  SerialPort port(link_);
  const std::vector<std::uint8_t> bytes(1000, 0x55);
  for (int i = 0; i < 200; ++i) port.write(bytes);
  EXPECT_GT(port.counters().bytes_not_written, 0u);
  EXPECT_EQ(port.counters().bytes_not_written + port.counters().bytes_written, 200'000u);
  EXPECT_FALSE(port.lost());
  read_all(board, port.counters().bytes_written);
  EXPECT_GT(port.write(every_byte()), 0u) << "it flows again once the board reads";
}

TEST_F(Serial, WhatHasNotLeftYetCanBeOvertaken) {
  Pty board(link_);
  SerialPort port(link_);
  const std::vector<std::uint8_t> bytes(1000, 0x55), urgent(10, 0x66);
  for (int i = 0; i < 200; ++i) port.write(bytes);
  ASSERT_GT(port.counters().bytes_not_written, 0u);
  const std::uint64_t written = port.counters().bytes_written;
  port.drop_unsent();
  ASSERT_EQ(port.write(urgent), urgent.size());
  // What a pseudo terminal has given to the other end cannot be called back.
  std::vector<std::uint8_t> heard;
  while (heard.empty() || heard.back() != 0x66) {
    const auto more = read_all(board, 1);
    ASSERT_FALSE(more.empty());
    heard.insert(heard.end(), more.begin(), more.end());
  }
  EXPECT_LT(heard.size(), written);
}

TEST_F(Serial, TelemetryFromBeforeTheOpenIsDiscarded) {
  Pty board(link_);
  board.write(std::vector<std::uint8_t>(100, 1));
  SerialPort port(link_);
  const std::vector<std::uint8_t> fresh{42};
  board.write(fresh);
  EXPECT_EQ(read_all(port, 1), fresh);
}

TEST_F(Serial, APulledCableIsNoticedByTheNextCallAndStaysNoticed) {
  auto board = std::make_unique<Pty>(link_);
  SerialPort port(link_);
  EXPECT_FALSE(port.lost());
  board.reset();
  EXPECT_TRUE(port.lost());
  std::uint8_t buffer[8];
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(port.read(buffer), 0u);
    EXPECT_EQ(port.write(every_byte()), 0u);
  }
  EXPECT_TRUE(port.lost());
  EXPECT_EQ(port.counters().losses, 1u);
}

TEST_F(Serial, ReadAndWriteNoticeAPulledCableByThemselves) {
  for (const bool by_read : {true, false}) {
    auto board = std::make_unique<Pty>(link_);
    SerialPort port(link_);
    board.reset();
    std::uint8_t buffer[8];
    by_read ? port.read(buffer) : port.write(every_byte());
    EXPECT_EQ(port.counters().losses, 1u);
  }
}

TEST_F(Serial, AReplugIsFoundByPathAndTriedAtMostEvery250Milliseconds) {
  auto board = std::make_unique<Pty>(link_);
  SerialPort port(link_);
  const std::string before = board->device();
  board.reset();
  ASSERT_TRUE(port.lost());
  EXPECT_FALSE(port.reopen(kSecond)) << "the path is gone";
  const Pty other(directory_ + "/other");  // takes the old number, so that the new board gets another
  board = std::make_unique<Pty>(link_);
  EXPECT_NE(board->device(), before);
  EXPECT_FALSE(port.reopen(kSecond + 249 * kMillisecond)) << "too early to try again";
  EXPECT_TRUE(port.lost());
  EXPECT_TRUE(port.reopen(kSecond + 250 * kMillisecond));
  EXPECT_FALSE(port.lost());
  const auto bytes = every_byte();
  EXPECT_EQ(port.write(bytes), bytes.size());
  EXPECT_EQ(read_all(*board, bytes.size()), bytes);
  EXPECT_EQ(port.counters().reopened, 1u);
}

TEST_F(Serial, TheLineIsRawClosesOnExecAndDoesNotResetTheBoard) {
  Pty board(link_);
  SerialPort port(link_);
  termios settings{};
  ASSERT_EQ(tcgetattr(port.native_handle(), &settings), 0);
  EXPECT_EQ(cfgetispeed(&settings), static_cast<speed_t>(B115200));
  EXPECT_EQ(settings.c_cflag & (CSIZE | PARENB | CSTOPB | CRTSCTS), static_cast<tcflag_t>(CS8));
  EXPECT_EQ(settings.c_cflag & HUPCL, 0u);
  EXPECT_EQ(settings.c_lflag & (ICANON | ECHO | ISIG), 0u);
  EXPECT_EQ(settings.c_iflag & (IXON | IXOFF | ICRNL), 0u);
  EXPECT_EQ(fcntl(port.native_handle(), F_GETFD) & FD_CLOEXEC, FD_CLOEXEC);
}

TEST_F(Serial, ASecondOpenIsRefusedUntilTheFirstCloses) {
  Pty board(link_);
  {
    SerialPort port(link_);
    const std::string text = refusal(link_);
    EXPECT_NE(text.find("another program holds it"), std::string::npos) << text;
    EXPECT_FALSE(port.lost());
  }
  EXPECT_EQ(refusal(link_), "opened");
}

TEST_F(Serial, AKilledHostDoesNotKeepTheLineLocked) {
  Pty board(link_);
  int ready[2];
  ASSERT_EQ(pipe(ready), 0);
  const pid_t child = fork();
  if (child == 0) {
    const SerialPort port(link_);
    if (write(ready[1], "x", 1) != 1) _exit(1);
    pause();
  }
  char byte = 0;
  ASSERT_EQ(read(ready[0], &byte, 1), 1);
  EXPECT_NE(refusal(link_), "opened");
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  EXPECT_EQ(refusal(link_), "opened");
  close(ready[0]);
  close(ready[1]);
}

TEST_F(Serial, RefusalsNameThePathAndTheRemedy) {
  const std::string missing = refusal(directory_ + "/none");
  EXPECT_NE(missing.find(directory_ + "/none"), std::string::npos) << missing;
  EXPECT_NE(missing.find("No such file"), std::string::npos) << missing;
  EXPECT_NE(missing.find("by-id"), std::string::npos) << missing;
  EXPECT_NE(missing.find("brltty"), std::string::npos) << missing;

  std::ofstream(directory_ + "/file") << "x";
  EXPECT_NE(refusal(directory_ + "/file").find("not a serial port"), std::string::npos);
  EXPECT_NE(refusal(directory_).find("not a serial port"), std::string::npos);
  EXPECT_NE(refusal("").find("cannot be found"), std::string::npos);

  const Pty board(link_);
  EXPECT_NE(refusal(board.device()).find("symbolic link"), std::string::npos) << refusal(board.device());
}

TEST_F(Serial, APortOfAnotherGroupIsRefusedWithTheNameOfTheGroup) {
  Pty board(link_);
  const uid_t before = geteuid();
  ASSERT_EQ(chmod(board.device().c_str(), 0), 0);
  fs::permissions(directory_, fs::perms::all);
  if (before == 0 && seteuid(65534) != 0) GTEST_SKIP() << "cannot give up root here";
  const std::string text = refusal(link_);
  ASSERT_TRUE(before != 0 || seteuid(before) == 0);
  EXPECT_NE(text.find("Permission denied"), std::string::npos) << text;
  EXPECT_NE(text.find("dialout"), std::string::npos) << text;
}

TEST_F(Serial, WithoutThePreloadAPseudoTerminalIsRefusedWithItsName) {
  Pty board(link_);
  int output[2];
  ASSERT_EQ(pipe(output), 0);
  const pid_t child = fork();
  if (child == 0) {
    dup2(output[1], 1);
    unsetenv("LD_PRELOAD");
    execl("/proc/self/exe", "serial_test", "--open", link_.c_str(), nullptr);
    _exit(1);
  }
  close(output[1]);
  char text[1024] = {};
  const ssize_t size = read(output[0], text, sizeof text - 1);
  EXPECT_GT(size, 0);
  waitpid(child, nullptr, 0);
  close(output[0]);
  EXPECT_NE(std::string(text).find("LD_PRELOAD=libfarhand_pty_modem.so"), std::string::npos) << text;
}

TEST_F(Serial, ThePtyLinkReplacesALinkToAPtyButNothingElseAndGoesWithItsOwner) {
  for (const char* target : {"/nowhere", "/etc/passwd"}) {
    fs::create_symlink(target, link_);
    try {
      const Pty board(link_);
      FAIL();
    } catch (const std::runtime_error& error) {
      EXPECT_NE(std::string(error.what()).find("which is no pseudo terminal"), std::string::npos) << error.what();
    }
    EXPECT_EQ(fs::read_symlink(link_), target);
    fs::remove(link_);
  }
  fs::create_symlink("/dev/pts/99999", link_);  // of an emulator that was killed
  {
    const Pty board(link_);
    EXPECT_EQ(fs::read_symlink(link_), board.device());
    {
      const Pty thief(link_);
      EXPECT_EQ(fs::read_symlink(link_), thief.device());
    }
    EXPECT_FALSE(fs::is_symlink(link_));
  }
  std::ofstream(link_) << "precious";
  try {
    const Pty board(link_);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("not a symbolic link"), std::string::npos) << error.what();
  }
  EXPECT_EQ(fs::file_size(link_), 8u);
  EXPECT_THROW(Pty(directory_ + "/no/such/place"), std::runtime_error);
  EXPECT_EQ(std::distance(fs::directory_iterator(directory_), {}), 1) << "no temporary link stays behind";
}

TEST_F(Serial, ThePtyDropsWhatNobodyReadsAndNeverWaits) {
  Pty board(link_);
  std::size_t written = 0;
  for (int i = 0; i < 1000; ++i) written += board.write(every_byte());
  EXPECT_LT(written, 256'000u);
}

TEST_F(Serial, NoCallOfTheLoopTouchesTheHeapOrAMutexEvenWhenFullOrLost) {
  if (kCounterIsBlind) GTEST_SKIP() << "a sanitizer owns malloc and the mutexes";
  auto board = std::make_unique<Pty>(link_);
  SerialPort port(link_);
  const auto bytes = every_byte();
  std::uint8_t buffer[64];
  const auto use = [&] {
    const TouchCounter counter;
    for (int i = 0; i < 1000; ++i) {
      port.write(bytes);
      port.read(buffer);
      port.lost();
    }
    return counter.since();
  };
  EXPECT_EQ(use(), Touched{});
  EXPECT_GT(port.counters().bytes_not_written, 0u);
  const TouchCounter counter;
  for (int i = 0; i < 1000; ++i) {
    board->read(buffer);
    board->write(bytes);
    port.read(buffer);
    port.drop_unsent();
  }
  EXPECT_EQ(counter.since(), Touched{});
  EXPECT_GT(port.counters().bytes_read, 0u);
  board.reset();
  EXPECT_EQ(use(), Touched{});
  EXPECT_TRUE(port.lost());
}

}  // namespace
}  // namespace farhand

int main(int argc, char** argv) {
  if (argc == 3 && std::string(argv[1]) == "--open") {
    std::puts(farhand::refusal(argv[2]).c_str());
    return 0;
  }
  farhand::restart_with_pty_modem(argv);
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
