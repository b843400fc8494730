#include "common/runtime/live_status.hpp"

#include <poll.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdio>

#include "common/station/states.hpp"

namespace farhand {
namespace {

std::string number_or_dash(const char* format, double value) {
  if (!std::isfinite(value)) return "-";
  char text[32];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

// "  patient: power, heat near", or nothing.
std::string limits_text(const char* who, std::uint32_t limits) {
  std::string text;
  for (const auto& [bit, name] : kLimitNames) {
    const bool acts = (limits & bit) != 0, near = (limits & bit << kWarningShift) != 0;
    if (acts || near) text += (text.empty() ? "" : ", ") + std::string(name) + (acts ? "" : " near");
  }
  return text.empty() ? "" : std::string("  ") + who + ": " + text;
}

std::string count_text(const char* what, std::uint64_t count) {
  return count == 0 ? "" : std::string("  ") + what + " " + std::to_string(count);
}

// A reader that does not read must not hold up the end of the session.
void write_if_ready(int fd, const std::string& text) {
  pollfd ready{fd, POLLOUT, 0};
  if (::poll(&ready, 1, 0) != 1 || (ready.revents & POLLOUT) == 0) return;
  [[maybe_unused]] const ssize_t written = ::write(fd, text.data(), text.size());
}

}  // namespace

std::string format_live_status(const LiveStatus& s) {
  char text[200];
  std::snprintf(text, sizeof text,
                "%7.1f s  %-9s  x_m %+7.3f  x_s %+7.3f rad  f_m %+7.3f  f_s %+7.3f N m  RTT %s ms  loss %s %%", s.t_s,
                name_of(s.state), s.x_m_rad, s.x_s_rad, s.f_m_nm, s.f_s_nm,
                number_or_dash("%.1f", 1e3 * s.rtt_s).c_str(), number_or_dash("%.1f", 1e2 * s.loss_share).c_str());
  std::string line;
  if (s.line_blind) {
    line = "  line not known: this PC is late";
  } else if (std::isfinite(s.line_s)) {
    char shown[40];
    std::snprintf(shown, sizeof shown, "  line %.1f ms%s", 1e3 * s.line_s, s.line_lags ? " LAGS" : "");
    line = shown;
  }
  if (s.line_slow) line.append("  ").append(slow_line_sentence(s.line_blind));
  const std::string gap = s.waits ? "  may resume" : "";
  return text + gap + count_text("resumed", s.resumed) + line + count_text("dropped", s.dropped) +
         count_text("not sent", s.unsent) + count_text("cut", s.cut) + limits_text("therapist", s.therapist_limits) +
         limits_text("patient", s.patient_limits) +
         (s.tendons_harder ? "  tendons run harder than at the fitting" : "");
}

LiveStatusPrinter::LiveStatusPrinter(bool quiet, int fd) : fd_(fd), terminal_(isatty(fd) != 0) {
  if (!quiet) printer_ = std::thread([this] { print_until_stopped(); });
}

LiveStatusPrinter::~LiveStatusPrinter() {
  if (!printer_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  stopped_.notify_one();
  printer_.join();
  if (line_open_) write_if_ready(fd_, "\n");
}

void LiveStatusPrinter::print_until_stopped() {
  const std::chrono::milliseconds interval(terminal_ ? 200 : 2000);
  bool over = false;
  while (!over) {
    {
      std::unique_lock lock(mutex_);
      over = stopped_.wait_for(lock, interval, [this] { return stop_; });
    }
    // Once more at the end, so that the last state stays on the screen.
    LiveStatus status;
    if (latest_.read(status)) print(status);
  }
}

void LiveStatusPrinter::print(const LiveStatus& status) {
  const std::string line = format_live_status(status);
  write_if_ready(fd_, terminal_ ? "\r" + line + "\x1b[K" : line + "\n");
  line_open_ = terminal_;
}

}  // namespace farhand
