// Ctrl-Z asks to come to rest first: a program that is suspended protects nobody. The terminal is given back at once,
// the loop stops as the operator would stop it, and then the program suspends itself (run_loop.hpp). A shell
// whose job is a script that was suspended at once may let it go on before that: then it is not suspended at all.
#pragma once

#include <csignal>

namespace farhand {

// One at a time per process. Restores the previous handler when it goes. Where SIGTSTP was ignored it stays so.
class SuspendSignal {
 public:
  SuspendSignal();
  ~SuspendSignal();
  SuspendSignal(const SuspendSignal&) = delete;
  SuspendSignal& operator=(const SuspendSignal&) = delete;

  bool asked() const noexcept;
  // Returns once the program goes on. At once where no shell could let it: the kernel suspends no orphaned job.
  void suspend() noexcept;

 private:
  struct sigaction previous_ {};
  struct sigaction previous_continue_ {};
};

}  // namespace farhand
