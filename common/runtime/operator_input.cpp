#include "common/runtime/operator_input.hpp"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <string_view>

namespace farhand {
namespace {

std::optional<OperatorAct> act_of_key(char key) noexcept {
  switch (key) {
    case 'e':
      return OperatorAct::kEngage;
    case 'h':
      return OperatorAct::kHold;
    case 's':
    case 'q':
      return OperatorAct::kStop;
    case 'r':
      return OperatorAct::kReset;
    case 'o':
      return OperatorAct::kHome;
    case 'i':
      return OperatorAct::kIdentify;
    default:
      return std::nullopt;
  }
}

std::optional<OperatorAct> act_of_word(std::string_view word) noexcept {
  if (word == "engage") return OperatorAct::kEngage;
  if (word == "hold") return OperatorAct::kHold;
  if (word == "stop") return OperatorAct::kStop;
  if (word == "reset") return OperatorAct::kReset;
  if (word == "home") return OperatorAct::kHome;
  if (word == "identify") return OperatorAct::kIdentify;
  return std::nullopt;
}

bool is_blank(char c) noexcept { return c == ' ' || c == '\t' || c == '\r'; }

// A background job that touches its terminal is stopped by the kernel, in the middle of a session.
bool in_foreground(int fd) noexcept { return tcgetpgrp(fd) == getpgrp(); }

}  // namespace

OperatorInput::OperatorInput(int fd) : fd_(fd) {
  if (isatty(fd_) == 0 || !in_foreground(fd_) || tcgetattr(fd_, &before_) != 0) return;
  termios keys = before_;
  keys.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
  keys.c_cc[VMIN] = 0;
  keys.c_cc[VTIME] = 0;
  terminal_ = tcsetattr(fd_, TCSANOW, &keys) == 0;
}

OperatorInput::~OperatorInput() {
  if (terminal_ && in_foreground(fd_)) tcsetattr(fd_, TCSANOW, &before_);
}

// Not O_NONBLOCK: that flag belongs to the open file, which the shell and our own stderr share. After poll() said so,
// one read() does not block.
void OperatorInput::fill() noexcept {
  pollfd wait{fd_, POLLIN, 0};
  if (closed_ || ::poll(&wait, 1, 0) <= 0) return;
  if ((wait.revents & (POLLERR | POLLNVAL)) != 0) {
    closed_ = true;
    return;
  }
  if (isatty(fd_) != 0 && !in_foreground(fd_) && (wait.revents & POLLHUP) == 0) return;
  std::array<char, 256> bytes;
  const ssize_t got = ::read(fd_, bytes.data(), bytes.size());
  const bool nothing_yet = got < 0 && (errno == EINTR || errno == EAGAIN);
  closed_ = got <= 0 && !nothing_yet;
  for (ssize_t i = 0; i < got; ++i) line_up(take(bytes[static_cast<std::size_t>(i)]));
  if (closed_) line_up(finish_line());  // a last line may end without a newline
}

void OperatorInput::line_up(std::optional<OperatorAct> act) noexcept {
  if (!act) return;
  if (*act == OperatorAct::kStop) acts_waiting_ = 0;
  if (acts_waiting_ == acts_.size()) {
    ++not_understood_;
  } else {
    acts_[acts_waiting_++] = *act;
  }
}

std::optional<OperatorAct> OperatorInput::poll() noexcept {
  fill();
  if (acts_waiting_ == 0) return std::nullopt;
  const OperatorAct next = acts_[0];
  std::copy(acts_.begin() + 1, acts_.begin() + static_cast<std::ptrdiff_t>(acts_waiting_--), acts_.begin());
  return next;
}

std::optional<OperatorAct> OperatorInput::take(char c) noexcept {
  if (terminal_) {
    const auto act = act_of_key(c);
    if (!act) ++not_understood_;
    return act;
  }
  if (c == '\n') return finish_line();
  if (line_size_ < line_.size()) {
    if (line_size_ > 0 || !is_blank(c)) line_[line_size_++] = c;
  } else if (!is_blank(c)) {
    line_too_long_ = true;
  }
  return std::nullopt;
}

std::optional<OperatorAct> OperatorInput::finish_line() noexcept {
  while (line_size_ > 0 && is_blank(line_[line_size_ - 1])) --line_size_;
  const std::string_view word(line_.data(), line_size_);
  const auto act = line_too_long_ ? std::nullopt : act_of_word(word);
  if (!act && (line_too_long_ || !word.empty())) ++not_understood_;
  line_size_ = 0;
  line_too_long_ = false;
  return act;
}

}  // namespace farhand
