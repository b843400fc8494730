#include "common/device/serial_port.hpp"

#include <fcntl.h>
#include <libserialport.h>
#include <linux/serial.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <termios.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <memory>
#include <stdexcept>

namespace farhand {
namespace {

constexpr Nanoseconds kReopenInterval = 250 * kMillisecond;

bool is_pseudo_terminal(const std::string& real_path) { return real_path.rfind("/dev/pts/", 0) == 0; }

// The library takes only names under /dev/ that /sys/class/tty knows as a symbolic link. A real port therefore goes by
// its resolved name. A pseudo terminal has none there; but "/dev/../../.." leads to the root both from /dev and from
// /sys/class/tty, so the path of a symbolic link to it behind that prefix passes the check and opens.
std::string name_for_library(const std::string& path, const std::string& real_path) {
  if (!is_pseudo_terminal(real_path)) return real_path;
  return "/dev/../../.." + std::filesystem::absolute(path).string();
}

const char* remedy_for(int error) {
  switch (error) {
    case ENOENT:
    case ENODEV:
    case ENXIO:
      return "; is it plugged in? Names change on replug, those in /dev/serial/by-id stay; with a CH340 adapter, "
             "brltty may have taken it (remove the package brltty)";
    case EACCES:
    case EPERM:
      return "; add yourself to the group dialout (sudo usermod -aG dialout $USER), log in again, or install "
             "scripts/99-farhand.rules";
    case EBUSY:
      return "; another program holds it: another farhand, a terminal program, or ModemManager probing a new port "
             "(wait half a minute, "
             "or install scripts/99-farhand.rules)";
    default:
      return "";
  }
}

}  // namespace

SerialPort::SerialPort(std::string path) : path_(std::move(path)) { open(); }

SerialPort::~SerialPort() { close(); }

void SerialPort::refuse(int error, const char* doing) const {
  throw std::runtime_error("serial port '" + path_ + "' cannot be " + doing + ": " + std::strerror(error) +
                           remedy_for(error));
}

void SerialPort::open() {
  const std::unique_ptr<char, decltype(&std::free)> resolved(::realpath(path_.c_str(), nullptr), &std::free);
  if (!resolved) refuse(errno, "found");
  const std::string real_path = resolved.get();
  const bool pseudo = is_pseudo_terminal(real_path);
  if (pseudo && !std::filesystem::is_symlink(path_)) {
    throw std::runtime_error("serial port '" + path_ +
                             "' is a pseudo terminal: give the path of a symbolic link to it");
  }
  if (sp_get_port_by_name(name_for_library(path_, real_path).c_str(), &port_) != SP_OK) {
    port_ = nullptr;
    throw std::runtime_error("serial port '" + path_ + "' is not a serial port (it is " + real_path + ")");
  }
  const auto fail = [this](int error, const char* doing) {
    close();
    refuse(error, doing);
  };

  if (sp_open(port_, SP_MODE_READ_WRITE) != SP_OK) {
    const int error = errno;
    release();
    if (pseudo && (error == ENOTTY || error == EINVAL)) {
      throw std::runtime_error("serial port '" + path_ +
                               "' is a pseudo terminal, which has no modem lines: start the program with "
                               "LD_PRELOAD=libfarhand_pty_modem.so (it lies beside the programs)");
    }
    refuse(error, "opened");
  }
  sp_get_port_handle(port_, &fd_);
  // A child must not keep the line open; two stations must not share it. The lock also holds against root and ends with
  // the process; TIOCEXCL keeps strangers out, but on a pseudo terminal it would outlive a killed process.
  fcntl(fd_, F_SETFD, FD_CLOEXEC);
  if (flock(fd_, LOCK_EX | LOCK_NB) != 0) {
    const int error = errno == EWOULDBLOCK ? EBUSY : errno;
    release();  // the line belongs to another: nothing of it may be touched
    refuse(error, "locked");
  }
  if (!pseudo && ioctl(fd_, TIOCEXCL) != 0) fail(errno, "locked");

  if (sp_set_baudrate(port_, 115200) != SP_OK || sp_set_bits(port_, 8) != SP_OK ||
      sp_set_parity(port_, SP_PARITY_NONE) != SP_OK || sp_set_stopbits(port_, 1) != SP_OK ||
      sp_set_flowcontrol(port_, SP_FLOWCONTROL_NONE) != SP_OK) {
    fail(errno, "set to 115200 baud 8N1");
  }
  // Without HUPCL the closing process does not drop DTR, which resets Arduino-style boards.
  termios settings{};
  if (tcgetattr(fd_, &settings) == 0) {
    settings.c_cflag &= ~static_cast<tcflag_t>(HUPCL);
    tcsetattr(fd_, TCSANOW, &settings);
  }
  // FTDI adapters hold bytes back for 16 ms unless asked; other drivers do not know the request.
  serial_struct driver{};
  if (ioctl(fd_, TIOCGSERIAL, &driver) == 0) {
    driver.flags |= ASYNC_LOW_LATENCY;
    ioctl(fd_, TIOCSSERIAL, &driver);
  }
  sp_flush(port_, SP_BUF_BOTH);  // telemetry from before we came is stale
  lost_ = false;
}

void SerialPort::close() noexcept {
  if (port_ == nullptr) return;
  // A close with bytes still to send may wait up to 30 s for a device that takes none.
  sp_flush(port_, SP_BUF_BOTH);
  ioctl(fd_, TIOCNXCL);
  release();
}

void SerialPort::release() noexcept {
  if (fd_ >= 0) sp_close(port_);
  sp_free_port(port_);
  port_ = nullptr;
  fd_ = -1;
}

// After an unplug the library's reads return 0 for ever, like an idle line: only poll() tells the two apart. It also
// keeps us from calling the library when it would fail with EAGAIN, a path on which it allocates an error text.
short SerialPort::ready(short events) noexcept {
  if (lost_) return 0;
  pollfd state{fd_, events, 0};
  if (::poll(&state, 1, 0) <= 0) return 0;
  if ((state.revents & (POLLHUP | POLLERR | POLLNVAL)) != 0) {
    lost_ = true;
    ++counters_.losses;
    return 0;
  }
  return state.revents;
}

bool SerialPort::lost() noexcept {
  ready(0);
  return lost_;
}

std::size_t SerialPort::write(std::span<const std::uint8_t> bytes) noexcept {
  std::size_t written = 0;
  if ((ready(POLLOUT) & POLLOUT) != 0) {
    const int taken = sp_nonblocking_write(port_, bytes.data(), bytes.size());
    if (taken > 0) written = static_cast<std::size_t>(taken);
  }
  counters_.bytes_written += written;
  counters_.bytes_not_written += bytes.size() - written;
  return written;
}

std::size_t SerialPort::read(std::span<std::uint8_t> buffer) noexcept {
  if (buffer.empty() || (ready(POLLIN) & POLLIN) == 0) return 0;
  const int got = sp_nonblocking_read(port_, buffer.data(), buffer.size());
  if (got <= 0) return 0;
  counters_.bytes_read += static_cast<std::uint64_t>(got);
  return static_cast<std::size_t>(got);
}

void SerialPort::drop_unsent() noexcept {
  if (!lost()) tcflush(fd_, TCOFLUSH);
}

bool SerialPort::reopen(Nanoseconds now) noexcept {
  if (!lost_) return true;
  if (now < next_attempt_ns_) return false;
  next_attempt_ns_ = now + kReopenInterval;
  try {
    close();
    open();
    ++counters_.reopened;
  } catch (...) {
    return false;  // still gone, or not yet ready; `open` left nothing behind
  }
  return true;
}

}  // namespace farhand
