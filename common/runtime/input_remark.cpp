#include "common/runtime/input_remark.hpp"

namespace farhand {

// Each byte that is not plain text is shown as one question mark, and a letter of several bytes too.
InputRemark remark_on(InputRemark::Kind kind, std::string_view line) noexcept {
  InputRemark remark;
  remark.kind = kind;
  std::size_t size = 0;
  for (const char c : line) {
    const auto byte = static_cast<unsigned char>(c);
    if ((byte & 0xC0) == 0x80) continue;  // the rest of a letter in UTF-8
    if (size == InputRemark::kShown) {
      for (int i = 0; i < 3; ++i) remark.text[size++] = '.';
      break;
    }
    remark.text[size++] = byte < 0x20 || byte > 0x7E ? '?' : c;
  }
  return remark;
}

std::string sentence_of(const InputRemark& remark) {
  using enum InputRemark::Kind;
  const std::string text = "\"" + std::string(remark.text.data()) + "\"";
  switch (remark.kind) {
    case kNone:
      return "";
    case kAwaitsSilence:
      return std::string(name_of(remark.act)) + ", unless another key follows within a second";
    case kUnfinished:
      return text + " is not understood, and no letter after it is: Backspace takes it back, Enter and Esc stop";
    case kNotUnderstood:
      return text +
             " is no word, so it stops; words are engage, hold, stop, reset, home, identify, and keys of a terminal "
             "act without Enter";
    case kTogether:
      return text + " came together with other input, which is no intent, so it stops";
    case kSuspending:
      return "comes to rest before it is suspended; after fg it is stopped until reset";
    case kBackground:
      return "runs in the background, where no key stops it: fg brings the keys back";
    case kClosed:
      return "the terminal of the keys is closed, so it stops";
  }
  return "";
}

}  // namespace farhand
