// Fixed priority and locked memory for the calling thread. The system may refuse both: a sentence then names the
// remedy, and the session runs on without them.
#pragma once

#include <string>
#include <vector>

namespace farhand {

struct RealtimeParams {
  int fifo_priority = 0;  // SCHED_FIFO 1..99; 0 leaves the scheduler alone
  bool lock_memory = false;
};

struct RealtimeReport {
  bool fifo = false;    // read back from the scheduler, not believed from the call
  bool locked = false;  // read back from the kernel's count of locked memory
  std::vector<std::string> warnings;
};

// To be called by the thread that will run the loop. Threads that it starts later do not inherit the priority.
RealtimeReport enter_realtime(const RealtimeParams& params);

}  // namespace farhand
