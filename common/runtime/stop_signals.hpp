// Ctrl-C, SIGTERM and a closed terminal ask for a safe stop; they never end the process themselves, however often they
// come. SIGPIPE is ignored, so that a reader of our output that goes away does not take the session with it.
#pragma once

#include <array>
#include <csignal>

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
  static constexpr std::array kStopping{SIGINT, SIGTERM, SIGHUP};
  std::array<struct sigaction, kStopping.size()> previous_{};
  struct sigaction previous_pipe_ {};
};

}  // namespace farhand
