// Every signal by which somebody may want the program to end (Ctrl-C, Ctrl-\, SIGTERM, a closed terminal), and those
// that end one which does not expect them, those of real time too, ask for a safe stop; they never end the process
// themselves, however often they come. Ignored are SIGPIPE, so that a reader of our output that goes away does not take
// the session with it, and what stops a job in the background that uses its terminal.
#pragma once

#include <array>
#include <csignal>
#include <utility>
#include <vector>

namespace farhand {

// One at a time per process. Restores the previous handlers when it goes.
class StopSignals {
 public:
  StopSignals();
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  // The first signal that asked for a stop, 0 while none did.
  int signal() const noexcept;

 private:
  static constexpr std::array kStopping{SIGINT,  SIGQUIT,   SIGTERM, SIGHUP,  SIGUSR1, SIGUSR2,  SIGALRM,
                                        SIGPROF, SIGVTALRM, SIGXCPU, SIGPOLL, SIGPWR,  SIGSTKFLT};
  static constexpr std::array kIgnored{SIGPIPE, SIGTTIN, SIGTTOU};
  std::vector<std::pair<int, struct sigaction>> previous_;
};

}  // namespace farhand
