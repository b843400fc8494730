// Gives pseudo terminals the modem lines that the serial library insists on: preloaded into a program (LD_PRELOAD), it
// lets that program drive an emulated board through the very code that drives a real one. Real ports are answered by
// the kernel alone.
#include <dlfcn.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <termios.h>

#include <cerrno>
#include <cstdarg>

namespace {

using Ioctl = int (*)(int, unsigned long, ...);

// Major numbers 136 to 143 are the host sides of pseudo terminals.
bool is_pseudo_terminal(int fd) {
  struct stat status {};
  return fstat(fd, &status) == 0 && S_ISCHR(status.st_mode) && major(status.st_rdev) >= 136 &&
         major(status.st_rdev) <= 143;
}

}  // namespace

extern "C" __attribute__((visibility("default"))) int ioctl(int fd, unsigned long request, ...) noexcept {
  static const auto next = reinterpret_cast<Ioctl>(dlsym(RTLD_NEXT, "ioctl"));
  va_list arguments;
  va_start(arguments, request);
  void* const argument = va_arg(arguments, void*);
  va_end(arguments);

  const int saved = errno;
  const int result = next(fd, request, argument);
  if (result == 0 || (errno != ENOTTY && errno != EINVAL) || !is_pseudo_terminal(fd)) return result;
  switch (request) {
    case TIOCMGET:
      // A cable that is plugged in: carrier, ready and clear to send.
      *static_cast<int*>(argument) = TIOCM_CAR | TIOCM_DSR | TIOCM_CTS | TIOCM_DTR | TIOCM_RTS;
      break;
    case TIOCMSET:
    case TIOCMBIS:
    case TIOCMBIC:
      break;
    default:
      return result;
  }
  errno = saved;
  return 0;
}
