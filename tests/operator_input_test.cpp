// The operator's acts from a pipe, line by line, and from a terminal, key by key. (What keys mean is in
// typed_keys_test.cpp; shells, job control and the ends of programs are in terminal_test.py.)
#include "common/runtime/operator_input.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <string>

#include "common/runtime/operator_notices.hpp"
#include "common/runtime/run_loop.hpp"
#include "tests/support/pipe.hpp"

namespace farhand {
namespace {

TEST(OperatorInput, ReadsOneWordPerLine) {
  Pipe pipe;
  OperatorInput input(pipe.out());
  EXPECT_EQ(input.poll(0), std::nullopt);
  pipe.say("engage\nhold\r\n  reset \t\nhome\nidentify\nfriction\n");
  EXPECT_EQ(input.poll(0), OperatorAct::kEngage);
  EXPECT_EQ(input.poll(0), OperatorAct::kHold);
  EXPECT_EQ(input.poll(0), OperatorAct::kReset);
  EXPECT_EQ(input.poll(0), OperatorAct::kHome);
  EXPECT_EQ(input.poll(0), OperatorAct::kIdentify);
  EXPECT_EQ(input.poll(0), OperatorAct::kSweep);
  EXPECT_EQ(input.poll(0), std::nullopt);
}

// However much lies before it, also while earlier lines still wait for their turn.
TEST(OperatorInput, AStopOvertakesWhatWasAskedBefore) {
  Pipe pipe;
  OperatorInput input(pipe.out());
  std::string many;
  for (int i = 0; i < 40; ++i) many += "hold\n";
  pipe.say(many);
  EXPECT_EQ(input.poll(0), OperatorAct::kHold);
  pipe.say("engage\nstop\nreset\n");
  EXPECT_EQ(input.poll(0), OperatorAct::kStop);
  EXPECT_EQ(input.poll(0), OperatorAct::kReset);
  EXPECT_EQ(input.poll(0), std::nullopt);
}

TEST(OperatorInput, JoinsALineThatComesInPieces) {
  Pipe pipe;
  OperatorInput input(pipe.out());
  pipe.say("eng");
  EXPECT_EQ(input.poll(0), std::nullopt);
  pipe.say("age\n");
  EXPECT_EQ(input.poll(0), OperatorAct::kEngage);
}

TEST(OperatorInput, EveryLineThatIsNoWordStopsAndIsSaid) {
  for (const std::string line :
       {"engage now", "ENGAGE", "Reset", "e", "r", "engageengageengage", "\xC3\xBC", "Meier", "top"}) {
    Pipe pipe;
    OperatorInput input(pipe.out());
    pipe.say(line);
    if (line.size() <= 16) {
      EXPECT_EQ(input.poll(0), std::nullopt) << line;
    }
    pipe.say("\n");
    EXPECT_EQ(input.poll(0), OperatorAct::kStop) << line;
    EXPECT_EQ(input.poll(0), std::nullopt) << line;
    InputRemark remark;
    ASSERT_TRUE(input.read_remark(remark)) << line;
    EXPECT_EQ(remark.kind, InputRemark::Kind::kNotUnderstood);
  }
}

TEST(OperatorInput, ALineThatCouldBeMeantAsStopStopsInAnyCaseAndBeforeItsEnd) {
  for (const std::string line : {"s", "S", "q", "Q", "stop", "STOP", "Stop", "  stop", "quit", "STOP!", "\x1b", "\x03",
                                 "eng\x03", "xxxxxxxxxxxxxxxxx"}) {
    Pipe pipe;
    OperatorInput input(pipe.out());
    pipe.say(line);
    EXPECT_EQ(input.poll(0), OperatorAct::kStop) << line;
    pipe.say("\nhold\n");
    EXPECT_EQ(input.poll(0), OperatorAct::kHold) << line << ": one stop is enough";
  }
  for (const std::string empty : {"\n", "\r\n", "  \t\n"}) {
    Pipe pipe;
    OperatorInput input(pipe.out());
    pipe.say(empty);
    EXPECT_EQ(input.poll(0), OperatorAct::kStop);
  }
}

TEST(OperatorInput, AnEndedInputIsSilentAndItsLastLineCounts) {
  Pipe pipe;
  OperatorInput input(pipe.out());
  pipe.say("engage");
  EXPECT_EQ(input.poll(0), std::nullopt);
  pipe.finish();
  EXPECT_EQ(input.poll(0), OperatorAct::kEngage);
  EXPECT_TRUE(input.closed());
  for (int i = 0; i < 100; ++i) EXPECT_EQ(input.poll(0), std::nullopt);
}

TEST(OperatorInput, AClosedDescriptorIsAnEndedInput) {
  Pipe pipe;
  const int fd = dup(pipe.out());
  close(fd);
  OperatorInput input(fd);
  EXPECT_EQ(input.poll(0), std::nullopt);
  EXPECT_TRUE(input.closed());
}

TEST(OperatorNotices, SayANewRemarkInALineAndFloodNobody) {
  Pipe said, pipe;
  OperatorInput input(pipe.out());
  {
    OperatorNotices notices("farhand-slave", input, said.in());
    for (int i = 0; i < 100; ++i) {
      pipe.say("Meier\n");
      input.poll(0);
      usleep(2000);
    }
  }
  said.finish();
  char text[8192] = {};
  const ssize_t size = read(said.out(), text, sizeof text - 1);
  const std::string printed(text, static_cast<std::size_t>(std::max<ssize_t>(size, 0)));
  EXPECT_TRUE(printed.starts_with("farhand-slave: \"Meier\" is no word, so it stops")) << printed;
  EXPECT_LE(std::count(printed.begin(), printed.end(), '\n'), 2 + 10) << "one a second, and one at the end";
}

// A terminal needs its own session leader to be in the foreground of, so what happens on one happens in a child
// process, which says by its exit code how often it was surprised.
class OnATerminal : public testing::Test {
 protected:
  OnATerminal() {
    grantpt(master_);
    unlockpt(master_);
    name_ = ptsname(master_);
  }
  ~OnATerminal() override { close(master_); }

  // The other end, so that the child's mode can be looked at and outlives the child.
  int open_it() const { return open(name_.c_str(), O_RDWR | O_NOCTTY); }
  template <class Body>
  int in_child(Body body) {
    const int held = open_it();
    const pid_t child = fork();
    if (child == 0) {
      setsid();
      _exit(body(open(name_.c_str(), O_RDWR)));  // the first one opened becomes the controlling terminal
    }
    int status = 0;
    waitpid(child, &status, 0);
    tcgetattr(held, &after_);
    close(held);
    return status;
  }
  static std::optional<OperatorAct> next(OperatorInput& input, int patience_ms = 10'000) {
    for (int i = 0; i < patience_ms; ++i) {
      if (const auto act = input.poll(monotonic_now())) return act;
      usleep(1000);
    }
    return std::nullopt;
  }

  int master_ = posix_openpt(O_RDWR | O_NOCTTY);
  std::string name_;
  termios after_{};
};

bool gives_lines(const termios& mode) {
  return (mode.c_lflag & (ICANON | ECHO)) == (ICANON | ECHO) && (mode.c_iflag & IXON) != 0;
}

TEST_F(OnATerminal, KeysComeAtOnceAndItIsAsBeforeAfterwards) {
  const int status = in_child([&](int fd) {
    termios during{};
    int surprises = 0;
    OperatorInput input(fd);
    tcgetattr(fd, &during);
    surprises += (during.c_lflag & (ICANON | ECHO)) != 0;
    surprises += (during.c_lflag & ISIG) == 0;
    surprises += (during.c_iflag & IXON) != 0;
    for (const char key : std::string("sSqQ \n\r\x13\x04\x1b")) {
      surprises += write(master_, &key, 1) != 1;
      surprises += next(input) != OperatorAct::kStop;
    }
    surprises += next(input, 400) != std::nullopt;  // the silence before
    surprises += write(master_, "e", 1) != 1;
    surprises += next(input) != OperatorAct::kEngage;
    surprises += input.closed();
    return surprises;
  });
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
  EXPECT_TRUE(gives_lines(after_));
}

// By `stty sane`, by a shell that takes its time after fg: what was typed meanwhile counts, too.
TEST_F(OnATerminal, TakesItAgainWhenItWasSetToLines) {
  const int status = in_child([&](int fd) {
    int surprises = 0;
    termios before{};
    tcgetattr(fd, &before);
    OperatorInput input(fd);
    next(input, 5);
    tcsetattr(fd, TCSANOW, &before);
    surprises += write(master_, "s", 1) != 1;
    surprises += next(input) != OperatorAct::kStop;
    return surprises;
  });
  EXPECT_EQ(status, 0);
  EXPECT_TRUE(gives_lines(after_));
}

TEST_F(OnATerminal, IsGivenBackInACrashAndByExit) {
  for (const int crash : {SIGSEGV, SIGABRT, SIGFPE, SIGBUS, SIGILL}) {
    const int status = in_child([&](int fd) {
      OperatorInput input(fd);
      raise(crash);
      return 0;
    });
    EXPECT_NE(status, 0) << crash;  // by the signal, or as a sanitizer ends it
    EXPECT_TRUE(gives_lines(after_)) << crash;
  }
  EXPECT_NE(in_child([&](int fd) -> int {
              OperatorInput input(fd);
              std::terminate();
            }),
            0);
  EXPECT_TRUE(gives_lines(after_));
  in_child([&](int fd) -> int {
    OperatorInput input(fd);
    std::exit(3);
  });
  EXPECT_TRUE(gives_lines(after_));
}

TEST_F(OnATerminal, AHangUpStops) {
  int ready[2];
  ASSERT_EQ(pipe(ready), 0);
  const pid_t child = fork();
  if (child == 0) {
    setsid();
    signal(SIGHUP, SIG_IGN);
    OperatorInput input(open(name_.c_str(), O_RDWR));
    close(std::exchange(master_, -1));
    const auto act = next(input);
    _exit(act == OperatorAct::kStop && input.closed() && !input.poll(monotonic_now()) ? 0 : 1);
  }
  close(std::exchange(master_, -1));
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
}

TEST_F(OnATerminal, OfAnotherForegroundIsLeftAlone) {
  const int status = in_child([&](int fd) {
    int surprises = 0;
    setpgid(0, 0);
    const pid_t other = fork();
    if (other == 0) {
      setpgid(0, 0);
      pause();
    }
    setpgid(other, other);
    signal(SIGTTOU, SIG_IGN);
    signal(SIGTTIN, SIG_IGN);
    surprises += tcsetpgrp(fd, other) != 0;
    OperatorInput input(fd);
    termios now{};
    tcgetattr(fd, &now);
    surprises += (now.c_lflag & ICANON) == 0;
    surprises += write(master_, "s\n", 2) != 2;
    surprises += next(input, 50) != std::nullopt;
    tcsetpgrp(fd, getpgrp());  // brought back: what was typed and read by nobody is for us
    surprises += next(input) != OperatorAct::kStop;
    tcgetattr(fd, &now);
    surprises += (now.c_lflag & ICANON) != 0;
    kill(other, SIGKILL);
    return surprises;
  });
  EXPECT_EQ(status, 0);
}

}  // namespace
}  // namespace farhand
