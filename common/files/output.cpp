#include "common/files/output.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <utility>

namespace farhand {
namespace {

namespace fs = std::filesystem;

constexpr int kMostNumbers = 100'000;

[[noreturn]] void refuse(const fs::path& file, const std::string& why) {
  throw std::runtime_error("cannot write " + file.string() + ": " + why);
}

bool is_there(const fs::path& file) {
  struct stat info {};
  return ::lstat(file.c_str(), &info) == 0;
}

// Of what a name leads to, for one that is there but is no regular file.
const char* kind_of(mode_t mode) {
  if (S_ISDIR(mode)) return "a directory";
  if (S_ISCHR(mode) || S_ISBLK(mode)) return "a device";
  if (S_ISFIFO(mode)) return "a pipe";
  if (S_ISSOCK(mode)) return "a socket";
  return nullptr;
}

fs::path directory_of(const fs::path& file) { return file.has_parent_path() ? file.parent_path() : fs::path("."); }

void require_writable(const fs::path& directory, const fs::path& file) {
  struct stat info {};
  if (::stat(directory.c_str(), &info) != 0) refuse(file, directory.string() + ": " + std::strerror(errno));
  if (!S_ISDIR(info.st_mode)) refuse(file, directory.string() + " is no directory");
  if (::access(directory.c_str(), W_OK | X_OK) != 0) refuse(file, directory.string() + ": " + std::strerror(errno));
}

// 0, or the reason. renameat2 is missing on some file systems, and so are hard links on others.
int rename_without_replacing(const fs::path& from, const fs::path& to) {
  if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return 0;
  if (errno != EINVAL && errno != ENOSYS) return errno;
  if (::link(from.c_str(), to.c_str()) != 0) return errno;
  ::unlink(from.c_str());
  return 0;
}

}  // namespace

fs::path numbered(const fs::path& file, int number) {
  if (number == 1) return file;
  fs::path name = file.stem();
  name += "-" + std::to_string(number);
  name += file.extension();
  return file.parent_path() / name;
}

int free_number(std::span<const fs::path> files) {
  for (int number = 1; number <= kMostNumbers; ++number) {
    if (std::none_of(files.begin(), files.end(),
                     [&](const fs::path& file) { return is_there(numbered(file, number)); }))
      return number;
  }
  refuse(files.front(), "there are " + std::to_string(kMostNumbers) + " of that name already");
}

void require_output(const fs::path& file) {
  if (!file.has_filename() || file.filename() == "." || file.filename() == "..") refuse(file, "it names no file");
  struct stat info {};
  if (::stat(file.c_str(), &info) == 0) {
    if (const char* kind = kind_of(info.st_mode)) refuse(file, std::string("it is ") + kind + ", not a regular file");
  }
  require_writable(directory_of(file), file);
}

void require_output_directory(const fs::path& directory) {
  fs::path there = directory;
  while (!is_there(there) && there.has_relative_path()) there = directory_of(there);
  require_writable(there, directory);
}

bool same_on_disk(const fs::path& a, const fs::path& b) {
  struct stat first {
  }, second{};
  return ::stat(a.c_str(), &first) == 0 && ::stat(b.c_str(), &second) == 0 && first.st_dev == second.st_dev &&
         first.st_ino == second.st_ino;
}

bool make_directory(const fs::path& directory) {
  if (::mkdir(directory.c_str(), 0700) != 0) {
    if (errno == EEXIST) return false;
    throw std::runtime_error("cannot make the directory " + directory.string() + ": " + std::strerror(errno));
  }
  ::chmod(directory.c_str(), 0700);  // a umask may have taken more away
  return true;
}

void make_directories(const fs::path& directory) {
  fs::path above;
  for (const fs::path& part : directory) {
    above /= part;
    if (!part.empty() && !fs::is_directory(above) && !make_directory(above) && !fs::is_directory(above)) {
      throw std::runtime_error("cannot make the directory " + directory.string() + ": " + above.string() +
                               " is no directory");
    }
  }
}

NewFile::NewFile(const fs::path& wanted, std::string_view suffix) : wanted_(wanted), suffix_(suffix) {
  require_output(wanted);
  for (; number_ <= kMostNumbers; ++number_) {
    file_ = numbered(wanted_, number_);
    now_ = file_;
    now_ += suffix_;
    const bool taken = is_there(file_);
    if (taken) in_the_way_.push_back(file_);
    if (!suffix_.empty() && is_there(now_)) {
      in_the_way_.push_back(now_);
      continue;
    }
    if (taken) continue;
    descriptor_ = ::open(now_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600);
    if (descriptor_ >= 0) break;
    if (errno != EEXIST) refuse(now_, std::strerror(errno));
    in_the_way_.push_back(now_);  // another program was faster
  }
  if (descriptor_ < 0) refuse(wanted_, "there are " + std::to_string(kMostNumbers) + " of that name already");
  ::fchmod(descriptor_, 0600);
}

NewFile::~NewFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void NewFile::complete() {
  const auto stays = [&](int why) {
    throw std::runtime_error(now_.string() + " stays unfinished: " + std::strerror(why));
  };
  if (::fsync(descriptor_) != 0 && errno != EINVAL) stays(errno);
  if (::close(std::exchange(descriptor_, -1)) != 0) stays(errno);
  if (suffix_.empty()) return;
  int why = 0;
  while ((why = rename_without_replacing(now_, file_)) == EEXIST && number_ < kMostNumbers) {
    in_the_way_.push_back(file_);
    file_ = numbered(wanted_, ++number_);
  }
  if (why != 0) stays(why);
}

void NewFile::discard() noexcept {
  if (descriptor_ >= 0) ::close(std::exchange(descriptor_, -1));
  ::unlink(now_.c_str());
}

std::string other_name(const NewFile& file) {
  const auto& there = file.in_the_way();
  if (there.empty()) return "";
  const bool one = there.size() == 1;
  return there.back().string() + (one ? "" : " and " + std::to_string(there.size() - 1) + " more") +
         (one ? " exists already and stays as it is: " : " exist already and stay as they are: ") +
         file.file().string() + " is written instead";
}

}  // namespace farhand
