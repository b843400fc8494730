#include "common/runtime/suspend_signal.hpp"

#include <atomic>
#include <cerrno>

#include "common/runtime/key_terminal.hpp"

namespace farhand {
namespace {

std::atomic<bool> suspend_asked{false};

void ask_to_suspend(int) {
  const int error = errno;
  suspend_asked = true;
  give_key_terminal_back(GivenBack::kWhileSuspended);  // now, because the shell may not wait for us
  errno = error;
}

void go_on(int) {
  suspend_asked = false;
  let_key_terminal_be_taken();
}

void take_over(struct sigaction* previous) noexcept {
  struct sigaction action {};
  action.sa_handler = ask_to_suspend;
  sigemptyset(&action.sa_mask);
  sigaddset(&action.sa_mask, SIGTTOU);
  sigaction(SIGTSTP, &action, previous);
}

}  // namespace

SuspendSignal::SuspendSignal() {
  suspend_asked = false;
  struct sigaction going_on {};
  going_on.sa_handler = go_on;
  sigemptyset(&going_on.sa_mask);
  sigaction(SIGCONT, &going_on, &previous_continue_);
  sigaction(SIGTSTP, nullptr, &previous_);
  if (previous_.sa_handler != SIG_IGN) take_over(nullptr);
}

SuspendSignal::~SuspendSignal() {
  sigaction(SIGTSTP, &previous_, nullptr);
  sigaction(SIGCONT, &previous_continue_, nullptr);
}

bool SuspendSignal::asked() const noexcept { return suspend_asked; }

void SuspendSignal::suspend() noexcept {
  if (!suspend_asked) return;
  struct sigaction as_usual {};
  as_usual.sa_handler = SIG_DFL;
  sigemptyset(&as_usual.sa_mask);
  sigaction(SIGTSTP, &as_usual, nullptr);
  raise(SIGTSTP);
  take_over(nullptr);
  suspend_asked = false;
  let_key_terminal_be_taken();
}

}  // namespace farhand
