// The friction of a patient's device as sweeps without a hand have found it: a small text file, one line for a sweep.
//
//   2026-12-01T09:30:00Z friction_nm 0.0512 spread_nm 0.0004
//
// The last line counts. A later sweep adds its line to a new file, which then takes the name of the old one: a reader
// sees the whole of either, and no result is lost.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "common/signal/known_friction.hpp"

namespace farhand {

struct SweptFriction {
  std::int64_t utc_s = 0;          // since 1970
  double F_c = 0.0, spread = 0.0;  // N m
};

// Nothing if there is no such file. Throws std::invalid_argument with a sentence that names the file and the line: not
// a regular file, writable by others, a line that is not as above, a value outside 0 to 0.5 N m.
std::optional<SweptFriction> load_friction(const std::filesystem::path& file);
// Adds a line; makes the file with mode 0600 if there is none. Throws std::runtime_error or std::invalid_argument.
void add_friction(const std::filesystem::path& file, const SweptFriction& swept);

// Threshold for a session that begins at now_utc_s. A result older than a day, or of a time to come, counts 1.5 times:
// tendons were refitted since.
KnownFriction friction_for(const std::optional<SweptFriction>& last, std::int64_t now_utc_s);
// What friction_for() has decided, and why.
std::string friction_sentence(const std::optional<SweptFriction>& last, std::int64_t now_utc_s);
// The same where the user has named no file.
std::string no_friction_file_sentence();

}  // namespace farhand
