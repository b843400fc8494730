// Every file that a program makes is made here: a new regular file that only its owner can read, and that never
// replaces another one. Recordings, scenes and reports are a patient's data, and an older recording may be the more
// valuable one.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace farhand {

// 1: NAME.ext as it is; 2, 3, ...: NAME-2.ext, NAME-3.ext.
std::filesystem::path numbered(const std::filesystem::path& file, int number);
// The first number under which none of these exists, so that files of one run carry one number.
int free_number(std::span<const std::filesystem::path> files);

// Throws std::runtime_error with a sentence if no new file or directory of this name, or of a numbered one, can be
// made: the name belongs to something other than a regular file (a directory), or its directory accepts no files.
void require_output(const std::filesystem::path& file);
void require_output_directory(const std::filesystem::path& directory);

// True if both names lead to the same file on disk; false if one of them leads to none.
bool same_on_disk(const std::filesystem::path& a, const std::filesystem::path& b);

// Makes a directory with mode 0700 whatever the umask. Returns false if the name is taken. Throws std::runtime_error.
bool make_directory(const std::filesystem::path& directory);
// Also makes missing parent directories; existing ones keep their mode. Throws std::runtime_error.
void make_directories(const std::filesystem::path& directory);

// A new, empty regular file with mode 0600 whatever the umask, open for writing.
class NewFile {
 public:
  // Takes the first number for which neither the name nor the name with the suffix exists. The file carries the suffix
  // until complete(). Throws std::runtime_error with a sentence.
  explicit NewFile(const std::filesystem::path& wanted, std::string_view suffix = "");
  ~NewFile();  // closes
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;

  // Syncs, closes and removes the suffix. If another file has got the name meanwhile, the next free one is used. Throws
  // std::runtime_error; the file then keeps its suffix.
  void complete();
  void discard() noexcept;  // closes and removes

  int descriptor() const { return descriptor_; }
  const std::filesystem::path& file() const { return file_; }       // its name when complete
  const std::filesystem::path& unfinished() const { return now_; }  // its name until then
  // Files because of which it got another name, each once.
  const std::vector<std::filesystem::path>& in_the_way() const { return in_the_way_; }

 private:
  std::filesystem::path wanted_, file_, now_;
  std::string suffix_;
  std::vector<std::filesystem::path> in_the_way_;
  int number_ = 1;
  int descriptor_ = -1;
};

// Empty, or a sentence that names the file that was made instead, and the one that was kept.
std::string other_name(const NewFile& file);

}  // namespace farhand
