// Ctrl-Z first brings the station to rest, because a suspended program protects nobody. The terminal is given back at
// once, the loop stops as with an operator's stop, and then the program suspends itself (run_loop.hpp). If the job of
// the shell is a script that was suspended at once, the shell may continue the job before that; then the program is not
// suspended at all.
#pragma once

#include <csignal>

namespace farhand {

// One object at a time per process. The destructor restores the previous handler. If SIGTSTP was ignored it stays so.
class SuspendSignal {
 public:
  SuspendSignal();
  ~SuspendSignal();
  SuspendSignal(const SuspendSignal&) = delete;
  SuspendSignal& operator=(const SuspendSignal&) = delete;

  bool asked() const noexcept;
  // Returns when the program is continued, or at once if no shell could continue it: the kernel suspends no orphaned
  // job.
  void suspend() noexcept;

 private:
  struct sigaction previous_ {};
  struct sigaction previous_continue_ {};
};

}  // namespace farhand
