// A stream into a new file. finish() reports data that could not be written, with the reason.
#pragma once

#include <array>
#include <ostream>
#include <streambuf>

#include "common/files/output.hpp"

namespace farhand {

class OutputStream : public std::ostream {
 public:
  // Throws like NewFile.
  explicit OutputStream(const std::filesystem::path& wanted);
  ~OutputStream() override;  // without finish() or keep(): removes the file, as half a result looks whole

  // Throws std::runtime_error if not all data are in the file.
  void finish();

  // Partial data are useful, like rows of a table: the file is kept even without finish().
  void keep() noexcept { kept_ = true; }

  const NewFile& made() const { return buffer_.file; }

 private:
  struct Buffer : std::streambuf {
    explicit Buffer(const std::filesystem::path& wanted);
    int_type overflow(int_type one) override;
    int sync() override;

    NewFile file;
    int why = 0;  // errno of the first write that failed
    std::array<char, 65536> bytes;
  };

  Buffer buffer_;
  bool finished_ = false, kept_ = false;
};

}  // namespace farhand
