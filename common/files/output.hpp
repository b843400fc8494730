// The one way in which a program makes a file: a new regular one, for its owner's eyes only, that never takes the place
// of anything. Recordings, scenes and reports are a patient's data, and an older recording may be the one worth having.
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

// Throws std::runtime_error with a sentence where no new file or directory of this name, or of a numbered one, can be
// made: something else than a regular file (a directory) has the name, or the directory around it takes none.
void require_output(const std::filesystem::path& file);
void require_output_directory(const std::filesystem::path& directory);

// Whether both names lead to one thing on disk; false where one leads to nothing.
bool same_on_disk(const std::filesystem::path& a, const std::filesystem::path& b);

// A directory with mode 0700 whatever the umask. False: the name is taken. Throws std::runtime_error.
bool make_directory(const std::filesystem::path& directory);
// With all that is missing above it; those that exist keep their mode. Throws std::runtime_error.
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

  // Syncs, closes and takes off the suffix. If another file has got the name meanwhile, the next free one is taken.
  // Throws std::runtime_error; the file then keeps its suffix.
  void complete();
  void discard() noexcept;  // closes and removes

  int descriptor() const { return descriptor_; }
  const std::filesystem::path& file() const { return file_; }       // as it is called when complete
  const std::filesystem::path& unfinished() const { return now_; }  // as it is called until then
  // What made it take another name, each once.
  const std::vector<std::filesystem::path>& in_the_way() const { return in_the_way_; }

 private:
  std::filesystem::path wanted_, file_, now_;
  std::string suffix_;
  std::vector<std::filesystem::path> in_the_way_;
  int number_ = 1;
  int descriptor_ = -1;
};

// Empty, or a sentence that says where the file went instead and what stays as it is.
std::string other_name(const NewFile& file);

}  // namespace farhand
