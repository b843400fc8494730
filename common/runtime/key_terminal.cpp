#include "common/runtime/key_terminal.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <string>

namespace farhand {
namespace {

// What a handler needs, and it has no other way to it than a global. `before` is written while `taken` is false.
struct Taken {
  std::atomic<bool> taken{false};
  std::atomic<GivenBack> given_back{GivenBack::kNo};
  bool known = false;  // how it was before
  int fd = -1;
  termios before{};
};
Taken the_terminal;
static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<GivenBack>::is_always_lock_free,
              "only lock-free atomics may be touched in a signal handler");

void restore() noexcept {
  if (the_terminal.taken.exchange(false)) tcsetattr(the_terminal.fd, TCSANOW, &the_terminal.before);
}

constexpr std::array kCrashes{SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGTRAP, SIGSYS};
std::array<struct sigaction, kCrashes.size()> handled_before;

void restore_in_a_crash(int number, siginfo_t* info, void*) {
  const int error = errno;
  restore();
  errno = error;
  for (std::size_t i = 0; i < kCrashes.size(); ++i) {
    if (kCrashes[i] == number) sigaction(number, &handled_before[i], nullptr);
  }
  // An instruction that failed fails again, now as it would have without us. What was sent must be sent again.
  if (info->si_code <= 0) raise(number);
}

// The stack may be what is broken.
void give_handlers_a_stack() {
  static std::array<char, 65536> memory;
  stack_t stack{};
  if (sigaltstack(nullptr, &stack) != 0 || (stack.ss_flags & SS_DISABLE) == 0) return;
  stack = {};
  stack.ss_sp = memory.data();
  stack.ss_size = memory.size();
  sigaltstack(&stack, nullptr);
}

void watch_crashes() {
  static const bool once = [] {
    give_handlers_a_stack();
    struct sigaction action {};
    action.sa_sigaction = restore_in_a_crash;
    action.sa_flags = SA_SIGINFO | SA_ONSTACK;
    sigemptyset(&action.sa_mask);
    sigaddset(&action.sa_mask, SIGTTOU);  // or restoring would stop the program
    for (std::size_t i = 0; i < kCrashes.size(); ++i) sigaction(kCrashes[i], &action, &handled_before[i]);
    return std::atexit(restore) == 0;
  }();
  static_cast<void>(once);
}

termios for_keys(termios mode) noexcept {
  mode.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO | IEXTEN);
  mode.c_iflag &= ~static_cast<tcflag_t>(IXON | IXOFF | IGNCR | INLCR | ISTRIP);
  mode.c_cc[VMIN] = 1;  // 0 would be the end of its input to a shell that finds the terminal so, after SIGKILL
  mode.c_cc[VTIME] = 0;
  return mode;
}

bool gives_keys(const termios& mode) noexcept {
  const termios wanted = for_keys(mode);
  return wanted.c_lflag == mode.c_lflag && wanted.c_iflag == mode.c_iflag && mode.c_cc[VMIN] == 1 &&
         mode.c_cc[VTIME] == 0;
}

}  // namespace

KeyTerminal::KeyTerminal(int fd) : fd_(fd), terminal_(isatty(fd) != 0) {
  if (!terminal_) return;
  own_ = open(("/proc/self/fd/" + std::to_string(fd)).c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
  watch_crashes();
  the_terminal.fd = fd_;
  the_terminal.known = false;
  tend();
}

KeyTerminal::~KeyTerminal() {
  if (!terminal_) return;
  if (in_foreground()) restore();
  the_terminal.taken = false;
  if (own_ >= 0) close(own_);
}

// A terminal that is not the controlling one of this process knows no foreground.
bool KeyTerminal::in_foreground() const noexcept {
  const pid_t foreground = tcgetpgrp(fd_);
  return foreground < 0 ? errno == ENOTTY : foreground == getpgrp();
}

bool KeyTerminal::tend() noexcept {
  if (!terminal_ || the_terminal.given_back != GivenBack::kNo || !in_foreground()) return false;
  termios now{};
  if (tcgetattr(fd_, &now) != 0 || gives_keys(now)) return true;
  the_terminal.taken = false;
  // What gives keys but not as we want them is a mode that we set and somebody changed, unless it was so at first.
  if ((now.c_lflag & ICANON) != 0 || !the_terminal.known) the_terminal.before = now;
  the_terminal.known = true;
  const termios keys = for_keys(now);
  the_terminal.taken = true;  // before it is true, for a handler may come between
  tcsetattr(fd_, TCSANOW, &keys);
  if (the_terminal.given_back != GivenBack::kNo) restore();
  return true;
}

void give_key_terminal_back(GivenBack how) noexcept {
  the_terminal.given_back = how;
  restore();
}
GivenBack key_terminal_is_given_back() noexcept { return the_terminal.given_back; }
void let_key_terminal_be_taken() noexcept {
  GivenBack suspended = GivenBack::kWhileSuspended;
  the_terminal.given_back.compare_exchange_strong(suspended, GivenBack::kNo);
}

}  // namespace farhand
