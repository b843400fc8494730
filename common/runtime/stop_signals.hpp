// Signals that ask for a safe stop: those by which a user ends a program (Ctrl-C, Ctrl-\, SIGTERM, a closed terminal),
// and all others whose default action ends a program, real-time signals included. They never end the process
// themselves, however often they come. Two kinds are ignored: SIGPIPE, so that a reader of our output that goes away
// does not end the session, and the signals that stop a background job which uses its terminal.
#pragma once

#include <array>
#include <csignal>
#include <utility>
#include <vector>

namespace farhand {

// One object at a time per process. The destructor restores the previous handlers.
class StopSignals {
 public:
  StopSignals();
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  // The first signal that asked for a stop; 0 if there was none.
  int signal() const noexcept;

 private:
  static constexpr std::array kStopping{SIGINT,  SIGQUIT,   SIGTERM, SIGHUP,  SIGUSR1, SIGUSR2,  SIGALRM,
                                        SIGPROF, SIGVTALRM, SIGXCPU, SIGPOLL, SIGPWR,  SIGSTKFLT};
  static constexpr std::array kIgnored{SIGPIPE, SIGTTIN, SIGTTOU};
  std::vector<std::pair<int, struct sigaction>> previous_;
};

}  // namespace farhand
