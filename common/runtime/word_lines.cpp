#include "common/runtime/word_lines.hpp"

#include <utility>

#include "common/runtime/operator_words.hpp"

namespace farhand {
namespace {

bool is_blank(char c) noexcept { return c == ' ' || c == '\t' || c == '\r'; }

}  // namespace

std::optional<OperatorAct> WordLines::take(char c) noexcept {
  if (c == '\n') return finish();
  if (is_blank(c) && size_ == 0) return std::nullopt;
  if (size_ < line_.size()) {
    line_[size_++] = c;
  } else if (!is_blank(c)) {
    no_word_ = true;
    return stop_now();
  }
  const bool control = static_cast<unsigned char>(c) < 0x20 && !is_blank(c);
  return control || (size_ == 1 && is_stop_letter(c)) ? stop_now() : std::nullopt;
}

std::optional<OperatorAct> WordLines::stop_now() noexcept {
  return std::exchange(stopped_, true) ? std::nullopt : std::optional(OperatorAct::kStop);
}

std::optional<OperatorAct> WordLines::end() noexcept { return size_ > 0 ? finish() : std::nullopt; }

std::optional<OperatorAct> WordLines::finish() noexcept {
  while (size_ > 0 && is_blank(line_[size_ - 1])) --size_;
  const std::string_view word(line_.data(), size_);
  std::optional<OperatorAct> act = no_word_ ? std::nullopt : act_of_word(word);
  if (!act && !word.empty()) remark_ = remark_on(InputRemark::Kind::kNotUnderstood, word);
  if (!act || *act == OperatorAct::kStop) act = stop_now();
  size_ = 0;
  no_word_ = stopped_ = false;
  return act;
}

InputRemark WordLines::take_remark() noexcept { return std::exchange(remark_, {}); }

}  // namespace farhand
