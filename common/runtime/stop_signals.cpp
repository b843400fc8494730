#include "common/runtime/stop_signals.hpp"

#include <poll.h>

#include <atomic>
#include <cerrno>

#include "common/runtime/key_terminal.hpp"

namespace farhand {
namespace {

// A handler has no other way to its object than a global.
std::atomic<int> stop_signal{0};
static_assert(std::atomic<int>::is_always_lock_free, "only lock-free atomics may be touched in a signal handler");

void note_signal(int number) {
  int none = 0;
  stop_signal.compare_exchange_strong(none, number);
  const int error = errno;
  give_key_terminal_back(GivenBack::kForGood);  // no key is needed any more, and a script around us may be gone already
  errno = error;
}

}  // namespace

StopSignals::StopSignals() {
  stop_signal = 0;
#ifdef __SANITIZE_THREAD__
  // The sanitizer's runtime (gcc 12) opens its book of signals in the first call that may block, and loses one that
  // comes while it does. Before there is a handler, none is lost.
  ::poll(nullptr, 0, 0);
#endif
  // No SA_RESTART: a sleeping thread wakes and looks.
  struct sigaction action {};
  action.sa_handler = note_signal;
  sigemptyset(&action.sa_mask);
  sigaddset(&action.sa_mask, SIGTTOU);
  const auto handle = [&](int number) {
    struct sigaction before {};
    if (sigaction(number, &action, &before) == 0) previous_.emplace_back(number, before);
  };
  for (const int number : kStopping) handle(number);
  for (int number = SIGRTMIN; number <= SIGRTMAX; ++number) handle(number);
  action.sa_handler = SIG_IGN;
  for (const int number : kIgnored) handle(number);
}

StopSignals::~StopSignals() {
  for (const auto& [number, before] : previous_) sigaction(number, &before, nullptr);
}

int StopSignals::signal() const noexcept { return stop_signal.load(std::memory_order_relaxed); }

}  // namespace farhand
