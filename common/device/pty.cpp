#include "common/device/pty.hpp"

#include <fcntl.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <system_error>

namespace farhand {
namespace {

namespace fs = std::filesystem;

// Under a new name and then over the old one: a host that looks meanwhile finds one or the other.
void place_link(const std::string& device, const std::string& link) {
  const fs::file_status there = fs::symlink_status(link);
  if (fs::exists(there) && !fs::is_symlink(there)) {
    throw std::runtime_error("'" + link + "' exists and is not a symbolic link: it is left alone, choose another path");
  }
  std::error_code unreadable;
  const fs::path target = fs::exists(there) ? fs::read_symlink(link, unreadable) : fs::path();
  if (!target.empty() && target.parent_path() != "/dev/pts") {
    throw std::runtime_error("'" + link + "' is a link to '" + target.string() +
                             "', which is no pseudo terminal: it is left alone, choose another path");
  }
  const std::string fresh = link + "." + std::to_string(getpid());
  std::error_code error;
  fs::create_symlink(device, fresh, error);
  if (!error) fs::rename(fresh, link, error);
  if (error) {
    std::error_code ignored;
    fs::remove(fresh, ignored);
    throw std::runtime_error("cannot place the link '" + link + "': " + error.message());
  }
}

}  // namespace

Pty::Pty(const std::string& link) : link_(fs::absolute(link)) {
  char name[64] = {};
  master_ = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  const bool opened =
      master_ >= 0 && grantpt(master_) == 0 && unlockpt(master_) == 0 && ptsname_r(master_, name, sizeof name) == 0;
  if (opened) host_side_ = open(name, O_RDWR | O_NOCTTY | O_CLOEXEC);
  termios raw{};
  const bool ready = host_side_ >= 0 && tcgetattr(host_side_, &raw) == 0;
  cfmakeraw(&raw);  // no echo: our own telemetry must not come back as a command
  const int error = ready && tcsetattr(host_side_, TCSANOW, &raw) == 0 ? 0 : errno;
  try {
    if (error != 0) throw std::runtime_error(std::string("cannot open a pseudo terminal: ") + std::strerror(error));
    device_ = name;
    place_link(device_, link_);
  } catch (...) {
    close(host_side_);
    close(master_);
    throw;
  }
}

Pty::~Pty() {
  // Another emulator may have taken over the path meanwhile.
  std::error_code error;
  if (fs::read_symlink(link_, error) == device_) fs::remove(link_, error);
  close(host_side_);
  close(master_);
}

std::size_t Pty::write(std::span<const std::uint8_t> bytes) noexcept {
  const ssize_t written = ::write(master_, bytes.data(), bytes.size());
  return written > 0 ? static_cast<std::size_t>(written) : 0;
}

std::size_t Pty::read(std::span<std::uint8_t> buffer) noexcept {
  const ssize_t got = ::read(master_, buffer.data(), buffer.size());
  return got > 0 ? static_cast<std::size_t>(got) : 0;
}

}  // namespace farhand
