#include "common/runtime/realtime.hpp"

#include <sched.h>
#include <sys/mman.h>

#include <cerrno>
#include <cstring>
#include <fstream>

namespace farhand {
namespace {

// The call can succeed and yet lock nothing (for example under a sanitizer, which intercepts it).
long locked_kilobytes() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind("VmLck:", 0) == 0) return std::stol(line.substr(6));
  }
  return 0;
}

// Pages of the stack that the loop will use must be there before it starts: a page fault is a disk-sized delay at
// worst.
void touch_stack() {
  volatile char pages[256 * 1024];
  for (std::size_t i = 0; i < sizeof pages; i += 4096) pages[i] = 0;
}

}  // namespace

RealtimeReport enter_realtime(const RealtimeParams& params) {
  RealtimeReport report;
  if (params.fifo_priority > 0) {
    sched_param wanted{};
    wanted.sched_priority = params.fifo_priority;
    const int error = sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &wanted) == 0 ? 0 : errno;
    sched_param now{};
    const int policy = sched_getscheduler(0) & ~SCHED_RESET_ON_FORK;
    report.fifo = policy == SCHED_FIFO && sched_getparam(0, &now) == 0 && now.sched_priority == params.fifo_priority;
    if (!report.fifo) {
      report.warnings.push_back(
          "real-time priority " + std::to_string(params.fifo_priority) + " was not granted (" +
          (error != 0 ? std::strerror(error) : "the scheduler reports another policy") +
          "), the loop runs at normal priority; to allow it, put '@realtime - rtprio 95' into "
          "/etc/security/limits.d/farhand.conf and join that group, or give the program cap_sys_nice with setcap");
    }
  }
  if (params.lock_memory) {
    const int error = mlockall(MCL_CURRENT | MCL_FUTURE) == 0 ? 0 : errno;
    report.locked = error == 0 && locked_kilobytes() > 0;
    if (!report.locked) {
      report.warnings.push_back(
          std::string("memory was not locked (") +
          (error != 0 ? std::strerror(error) : "the kernel counts no locked page") +
          "), page faults may delay the loop; to allow it, put '@realtime - memlock unlimited' into "
          "/etc/security/limits.d/farhand.conf and join that group, or give the program cap_ipc_lock with setcap");
    }
    touch_stack();
  }
  return report;
}

}  // namespace farhand
