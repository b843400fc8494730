#include "common/runtime/operator_notices.hpp"

#include <poll.h>
#include <unistd.h>

namespace farhand {

OperatorNotices::OperatorNotices(const std::string& program, OperatorInput& input, int fd)
    : program_(program), input_(input), fd_(fd), terminal_(isatty(fd) != 0) {
  speaker_ = std::thread([this] { say_what_comes(); });
}

OperatorNotices::~OperatorNotices() {
  over_ = true;
  speaker_.join();
  say();
}

void OperatorNotices::say_what_comes() noexcept {
  constexpr int kLook_ms = 50, kPause_ms = 1000;
  int silent_ms = kPause_ms;
  while (!over_) {
    ::poll(nullptr, 0, kLook_ms);
    silent_ms += kLook_ms;
    if (silent_ms >= kPause_ms && say()) silent_ms = 0;
  }
}

// The live line of a terminal is written over, and comes back below. What cannot be written at once is lost.
bool OperatorNotices::say() noexcept {
  InputRemark remark;
  pollfd ready{fd_, POLLOUT, 0};
  if (!input_.read_remark(remark) || ::poll(&ready, 1, 0) != 1 || (ready.revents & POLLOUT) == 0) return false;
  const std::string text = program_ + ": " + sentence_of(remark);
  const std::string line = terminal_ ? "\r" + text + "\x1b[K\n" : text + "\n";
  [[maybe_unused]] const ssize_t written = ::write(fd_, line.data(), line.size());
  return true;
}

}  // namespace farhand
