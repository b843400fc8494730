#include "common/runtime/stop_input.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <stdexcept>

namespace farhand {
namespace {

constexpr int kReads = 16;  // per tick: what babbles on is pressed anyway

bool interrupted(ssize_t got) noexcept { return got < 0 && (errno == EINTR || errno == EAGAIN); }

// Ours is non-blocking. One that was passed to us keeps the flags that it shares with others.
int descriptor_of(const std::string& what, bool& ours) {
  constexpr std::size_t kPrefix = 3;
  ours = what.compare(0, kPrefix, "fd:") != 0;
  if (ours) return open(what.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC | O_NOCTTY);
  int fd = -1;
  const char* const end = what.data() + what.size();
  const auto [rest, error] = std::from_chars(what.data() + kPrefix, end, fd);
  if (error != std::errc() || rest != end || fd < 0) throw std::runtime_error("'" + what + "' is not fd:N");
  if (fd == STDIN_FILENO) throw std::runtime_error("'fd:0' is where the operator's keys come from");
  return fd;
}

}  // namespace

StopInput::StopInput(const std::string& what) {
  if (what.empty()) return;
  const auto refuse = [&](const std::string& why) {
    if (ours_ && fd_ >= 0) close(fd_);
    throw std::runtime_error("the patient's stop cannot be read from '" + what + "': " + why);
  };
  try {
    fd_ = descriptor_of(what, ours_);
  } catch (const std::runtime_error& error) {
    refuse(error.what());
  }
  struct stat info {};
  if (fd_ < 0 || fstat(fd_, &info) != 0) refuse(std::strerror(errno));
  if (S_ISDIR(info.st_mode)) refuse("it is a directory");
  if (tcgetpgrp(fd_) >= 0) refuse("it is the terminal of this program, where the operator's keys come from");
  take_each_byte();
  kind_ = S_ISREG(info.st_mode) ? Kind::kFile : Kind::kEvents;
  if (kind_ == Kind::kFile) {
    if (const ssize_t got = pread(fd_, &at_start_, 1, 0); got != 1)
      refuse(got < 0 ? std::strerror(errno) : "it is empty");
    return;
  }
  first_ = came();
  // A pipe that nobody has opened for writing looks like one that is silent, except to read().
  if (S_ISFIFO(info.st_mode) && ours_ && !first_) {
    char byte = 0;
    const ssize_t got = read(fd_, &byte, 1);
    first_ = got == 1;
    broken_ = got == 0;
  }
  if (broken_) refuse("it has ended, nobody holds its other end");
}

// A serial line would keep its bytes until a newline, make signals of some and stop at others.
void StopInput::take_each_byte() {
  if (isatty(fd_) == 0 || tcgetattr(fd_, &before_) != 0) return;
  termios raw = before_;
  cfmakeraw(&raw);
  raw.c_iflag &= ~static_cast<tcflag_t>(IGNBRK | IXOFF | IXANY);
  raw.c_cc[VMIN] = 1;
  raw.c_cc[VTIME] = 0;
  line_ = tcsetattr(fd_, TCSANOW, &raw) == 0;
}

StopInput::~StopInput() {
  if (line_) tcsetattr(fd_, TCSANOW, &before_);
  if (ours_) close(fd_);
}

bool StopInput::pressed() noexcept {
  const bool before = first_;
  first_ = false;
  if (kind_ == Kind::kNone) return false;
  const bool now = kind_ == Kind::kFile ? changed() : came();
  return before || now || broken_;
}

bool StopInput::came() noexcept {
  bool any = false;
  std::array<char, 256> bytes;
  for (int i = 0; i < kReads && !broken_; ++i) {
    pollfd ready{fd_, POLLIN | POLLPRI, 0};
    if (poll(&ready, 1, 0) <= 0) return any;
    any = true;
    if ((ready.revents & POLLIN) == 0) {
      broken_ = (ready.revents & (POLLHUP | POLLERR | POLLNVAL)) != 0;
      return any;
    }
    const ssize_t got = read(fd_, bytes.data(), bytes.size());
    broken_ = got <= 0 && !interrupted(got);
  }
  return any;
}

bool StopInput::changed() noexcept {
  char now = 0;
  const ssize_t got = pread(fd_, &now, 1, 0);
  if (interrupted(got)) return false;
  broken_ = broken_ || got != 1;
  return now != at_start_;
}

}  // namespace farhand
