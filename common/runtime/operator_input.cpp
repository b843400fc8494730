#include "common/runtime/operator_input.hpp"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

namespace farhand {

// A background job that reads its terminal would be stopped by the kernel, in the middle of a session. To be looked at
// before each read; that the terminal gives keys, now and then.
bool OperatorInput::may_read() noexcept {
  constexpr std::uint32_t kTended = 16;
  if (!keys()) return true;
  const bool look = polls_++ % kTended == 0 || where_ != Terminal::kHere;
  const GivenBack given_back = key_terminal_is_given_back();
  const bool here = look ? terminal_.tend() : given_back == GivenBack::kNo && terminal_.in_foreground();
  const Terminal now = here                                ? Terminal::kHere
                       : given_back == GivenBack::kNo      ? Terminal::kElsewhere
                       : given_back == GivenBack::kForGood ? Terminal::kGone
                                                           : Terminal::kSuspending;
  if (now == where_) return here;
  where_ = now;
  typed_.forget();
  if (now == Terminal::kSuspending) say({.kind = InputRemark::Kind::kSuspending});
  if (now == Terminal::kElsewhere) say({.kind = InputRemark::Kind::kBackground});
  return here;
}

// A pipe is not set to O_NONBLOCK: that flag belongs to the open file, which others share. After poll() said so, one
// read() does not block.
void OperatorInput::fill(Nanoseconds now) noexcept {
  if (closed_) return;
  const bool here = may_read();
  pollfd wait{keys() ? terminal_.reader() : fd_, POLLIN, 0};
  const int ready = ::poll(&wait, 1, 0);
  if (ready > 0 && (wait.revents & (POLLERR | POLLNVAL)) != 0) return close_it();
  if (ready > 0 && (wait.revents & POLLHUP) != 0 && keys()) return close_it();
  if (!here) return;
  if (ready <= 0) {
    if (ready == 0 && keys()) line_up(typed_.quiet(now));
    return say(typed_.take_remark());
  }
  std::array<char, 256> bytes;
  const ssize_t got = ::read(wait.fd, bytes.data(), bytes.size());
  for (ssize_t i = 0; i < got; ++i) {
    const char c = bytes[static_cast<std::size_t>(i)];
    line_up(keys() ? typed_.take(c) : lines_.take(c));
  }
  if (keys()) {
    // Ctrl-D in an empty line.
    if (got == 0) line_up(OperatorAct::kStop);
  } else if (got == 0 || (got < 0 && errno != EINTR && errno != EAGAIN)) {
    close_it();
  }
  say(keys() ? typed_.take_remark() : lines_.take_remark());
}

void OperatorInput::close_it() noexcept {
  closed_ = true;
  if (keys()) {
    line_up(OperatorAct::kStop);
    say({.kind = InputRemark::Kind::kClosed});
  } else {
    line_up(lines_.end());
  }
}

void OperatorInput::line_up(std::optional<OperatorAct> act) noexcept {
  if (!act) return;
  if (*act == OperatorAct::kStop) acts_waiting_ = 0;
  if (acts_waiting_ < acts_.size()) acts_[acts_waiting_++] = *act;
}

void OperatorInput::say(const InputRemark& remark) noexcept {
  if (remark.kind != InputRemark::Kind::kNone) remarks_.write(remark);
}

std::optional<OperatorAct> OperatorInput::poll(Nanoseconds now) noexcept {
  fill(now);
  if (acts_waiting_ == 0) return std::nullopt;
  const OperatorAct next = acts_[0];
  std::copy(acts_.begin() + 1, acts_.begin() + static_cast<std::ptrdiff_t>(acts_waiting_--), acts_.begin());
  return next;
}

void OperatorInput::wait(Nanoseconds now) noexcept {
  if (!keys()) return;
  fill(now);
  acts_waiting_ = acts_waiting_ > 0 && acts_[0] == OperatorAct::kStop ? 1 : 0;
}

}  // namespace farhand
