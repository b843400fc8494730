#include "common/runtime/friction_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <stdexcept>

#include "common/files/output.hpp"
#include "common/record/utc_text.hpp"

namespace farhand {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kDay = 86'400, kAhead = 300;  // s: clocks of two PCs may differ by some minutes
constexpr double kMost = 0.5;                        // N m: no sweep finds more
constexpr double kOld = 1.5;

[[noreturn]] void refuse(const fs::path& file, const std::string& why) {
  throw std::invalid_argument("friction file " + file.string() + ": " + why);
}

double value_of(const fs::path& file, int line, const char* field, double value) {
  if (!(value >= 0.0 && value <= kMost)) {
    char text[160];
    std::snprintf(text, sizeof text, "line %d: %s = %g: must be from 0 to %g N m", line, field, value, kMost);
    refuse(file, text);
  }
  return value;
}

SweptFriction line_of(const fs::path& file, int number, const std::string& line) {
  std::tm date{};
  double F_c = 0.0, spread = 0.0;
  int end = 0;
  const int read =
      std::sscanf(line.c_str(), "%4d-%2d-%2dT%2d:%2d:%2dZ friction_nm %lf spread_nm %lf%n", &date.tm_year, &date.tm_mon,
                  &date.tm_mday, &date.tm_hour, &date.tm_min, &date.tm_sec, &F_c, &spread, &end);
  date.tm_year -= 1900;
  date.tm_mon -= 1;
  const std::int64_t utc_s = ::timegm(&date);
  // A date that is none (a month 13) comes back as another one.
  if (read != 8 || end != static_cast<int>(line.size()) || utc_text(utc_s) != line.substr(0, line.find(' '))) {
    refuse(file, "line " + std::to_string(number) +
                     ": must be a date, the friction and its spread in N m, like "
                     "'2026-12-01T09:30:00Z friction_nm 0.0512 spread_nm 0.0004'");
  }
  return {utc_s, value_of(file, number, "friction_nm", F_c), value_of(file, number, "spread_nm", spread)};
}

// Empty if there is no file.
std::string text_of(const fs::path& file) {
  constexpr std::size_t kLargest = 1 << 20;
  const int fd = ::open(file.c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC | O_NONBLOCK);
  if (fd < 0) {
    if (errno == ENOENT) return {};
    refuse(file, errno == ELOOP ? "is a symbolic link" : std::strerror(errno));
  }
  struct stat info {};
  std::string text, problem;
  if (::fstat(fd, &info) != 0 || !S_ISREG(info.st_mode)) {
    problem = "is not a regular file";
  } else if ((info.st_mode & 022) != 0) {
    problem = "others may write to it, and it decides what the therapist feels: chmod 600 " + file.string();
  } else if (static_cast<std::size_t>(info.st_size) > kLargest) {
    problem = "has more than a megabyte";
  }
  char part[4096];
  for (ssize_t got = 1; problem.empty() && got > 0;) {
    got = ::read(fd, part, sizeof part);
    if (got < 0) problem = std::strerror(errno);
    if (got > 0) text.append(part, static_cast<std::size_t>(got));
  }
  ::close(fd);
  if (!problem.empty()) refuse(file, problem);
  if (text.empty()) refuse(file, "line 1: is empty; remove the file, or sweep again with another name");
  return text;
}

}  // namespace

std::optional<SweptFriction> load_friction(const fs::path& file) {
  const std::string text = text_of(file);
  std::optional<SweptFriction> last;
  int number = 0;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    last = line_of(file, ++number, text.substr(at, end - at));
    at = end + 1;
  }
  return last;
}

void add_friction(const fs::path& file, const SweptFriction& swept) {
  load_friction(file);  // nothing is added to what cannot be read
  std::string text = text_of(file);
  if (!text.empty() && text.back() != '\n') text += '\n';
  char line[128];
  std::snprintf(line, sizeof line, "%s friction_nm %.4f spread_nm %.4f\n", utc_text(swept.utc_s).c_str(), swept.F_c,
                swept.spread);
  text += line;
  NewFile part(file.string() + ".new");
  const bool whole = ::write(part.descriptor(), text.data(), text.size()) == static_cast<ssize_t>(text.size());
  if (!whole) {
    part.discard();
    throw std::runtime_error("friction file " + file.string() + ": cannot be written");
  }
  part.complete();
  if (::rename(part.file().c_str(), file.c_str()) != 0)
    throw std::runtime_error("friction file " + file.string() + ": " + std::strerror(errno) + "; the result is in " +
                             part.file().string());
}

KnownFriction friction_for(const std::optional<SweptFriction>& last, std::int64_t now_utc_s) {
  if (!last) return {};
  const std::int64_t age = now_utc_s - last->utc_s;
  const bool fresh = age <= kDay && age >= -kAhead;
  return {.threshold = fresh ? last->F_c : kOld * last->F_c, .known = fresh};
}

std::string friction_sentence(const std::optional<SweptFriction>& last, std::int64_t now_utc_s) {
  const KnownFriction taken = friction_for(last, now_utc_s);
  char text[256];
  if (!last) {
    std::snprintf(text, sizeof text,
                  "the friction of this device was never measured: %.3f N m is assumed; measure it with `friction` "
                  "before the hand is strapped in",
                  taken.threshold);
  } else if (taken.known) {
    std::snprintf(text, sizeof text, "the friction of this device is %.4f N m (spread %.4f N m), measured on %s",
                  last->F_c, last->spread, utc_text(last->utc_s).c_str());
  } else {
    std::snprintf(
        text, sizeof text,
        "the friction of this device was measured on %s, %s: 1.5 times its %.4f N m is assumed; measure it "
        "again with `friction` before the hand is strapped in",
        utc_text(last->utc_s).c_str(),
        last->utc_s > now_utc_s ? "which is still to come (is this PC's clock right?)" : "more than a day ago",
        last->F_c);
  }
  return text;
}

std::string no_friction_file_sentence() {
  char text[256];
  std::snprintf(text, sizeof text,
                "without --friction FILE nothing is known of the friction of this device: %.1f N m is taken as "
                "threshold of a contact, because tendons in good order have less",
                KnownFriction{}.threshold);
  return text;
}

}  // namespace farhand
