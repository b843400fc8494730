// Input from a pipe or file, one byte at a time: a word in each line (operator_words.hpp), with blanks around it. Every
// other line stops, an empty one too, because it may have been meant as a stop. It stops as soon as the line begins
// with s or q, holds a control character or has more letters than any word, else at its end.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "common/runtime/input_remark.hpp"

namespace farhand {

class WordLines {
 public:
  std::optional<OperatorAct> take(char c) noexcept;
  // A last line may end without a newline.
  std::optional<OperatorAct> end() noexcept;
  InputRemark take_remark() noexcept;

 private:
  std::optional<OperatorAct> stop_now() noexcept;
  std::optional<OperatorAct> finish() noexcept;

  std::array<char, 16> line_{};  // longer than the longest word
  std::size_t size_ = 0;
  bool no_word_ = false;
  bool stopped_ = false;  // by this line
  InputRemark remark_;
};

}  // namespace farhand
