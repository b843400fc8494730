#include "common/runtime/typed_keys.hpp"

#include <algorithm>
#include <utility>

#include "common/runtime/operator_words.hpp"

namespace farhand {
namespace {

constexpr char kEsc = 0x1B, kCtrlU = 0x15, kBackspace = 0x08, kDelete = 0x7F;

bool is_control(char c) noexcept { return static_cast<unsigned char>(c) < 0x20; }
bool is_stop_key(char c) noexcept { return is_stop_letter(c) || c == ' ' || is_control(c); }
bool is_hold_key(char c) noexcept { return c == 'h' || c == 'H'; }

OperatorAct act_of_letter(char c) noexcept {
  switch (c) {
    case 'e':
      return OperatorAct::kEngage;
    case 'r':
      return OperatorAct::kReset;
    case 'o':
      return OperatorAct::kHome;
    case 'i':
      return OperatorAct::kIdentify;
    case 'f':
      return OperatorAct::kSweep;
    default:
      return OperatorAct::kNone;
  }
}

}  // namespace

std::optional<OperatorAct> TypedKeys::take(char c) noexcept {
  const bool after_silence = quiet_since_ && quiet_ - *quiet_since_ >= kBefore;
  quiet_since_.reset();
  told_ = false;
  const OperatorAct awaited = std::exchange(awaits_, OperatorAct::kNone);
  const bool pasted = awaited != OperatorAct::kNone && word_;
  if (pasted) remark_ = remark_on(InputRemark::Kind::kTogether, name_of(awaited));
  if (after_silence) escape_ = Escape::kNone;

  std::optional<OperatorAct> act;
  if (c == kEsc) {
    clear();
    escape_ = Escape::kStarted;
    act = OperatorAct::kStop;
  } else if (goes_on_with_escape(c)) {
    if (is_stop_key(c)) act = OperatorAct::kStop;
  } else if (c == '\n' || c == '\r') {
    act = enter();
  } else if (c == kBackspace || c == kDelete) {
    take_back();
  } else if (c == kCtrlU) {
    clear();
  } else if (is_control(c)) {
    act = OperatorAct::kStop;
  } else {
    act = text(c, after_silence);
  }
  return pasted ? OperatorAct::kStop : act;
}

// The bytes of a sequence lie in the line until it is complete, so that one that breaks off is text.
bool TypedKeys::goes_on_with_escape(char c) noexcept {
  if (escape_ == Escape::kNone || c < 0x20 || c > 0x7E) {  // others begin no part of one
    escape_ = Escape::kNone;
    return false;
  }
  const bool final = c >= 0x40;
  Escape next = Escape::kNone;
  if (escape_ == Escape::kStarted) {
    if (c == '[') next = Escape::kCsi;
    if (c == 'O') next = Escape::kSs3;
    if (next == Escape::kNone) {
      escape_ = Escape::kNone;
      return c == '\\';  // the end of an answer; anything else was typed after Esc
    }
  } else if (escape_ == Escape::kCsi && c == '[' && size_ == 1) {
    next = Escape::kLinuxCsi;  // a function key of the console
  } else if (escape_ == Escape::kCsi && !final) {
    next = Escape::kCsi;
  }
  escape_ = next;
  if (next == Escape::kNone) {
    clear();
  } else if (size_ < line_.size()) {
    alone_ = false;
    line_[size_++] = c;
  }
  return true;
}

std::optional<OperatorAct> TypedKeys::enter() noexcept {
  const std::string_view said = line();
  const std::optional<OperatorAct> act = act_of_word(said);
  const bool blank = std::all_of(said.begin(), said.end(), [](char c) { return is_stop_key(c) || is_hold_key(c); });
  std::optional<OperatorAct> result = OperatorAct::kStop;
  if (!act) {
    if (!blank) remark_ = remark_on(InputRemark::Kind::kNotUnderstood, said);
  } else if (!needs_intent(*act)) {
    result = act;
  } else if (!alone_) {
    remark_ = remark_on(InputRemark::Kind::kTogether, said);
  } else {
    awaits_ = *act;
    word_ = true;
    result = std::nullopt;
  }
  clear();
  return result;
}

std::optional<OperatorAct> TypedKeys::text(char c, bool after_silence) noexcept {
  if (size_ == 0) alone_ = after_silence;
  if (size_ < line_.size()) line_[size_++] = c;
  if (is_stop_key(c)) return OperatorAct::kStop;
  if (is_hold_key(c)) return OperatorAct::kHold;
  if (size_ == 1 && alone_ && act_of_letter(c) != OperatorAct::kNone) {
    awaits_ = act_of_letter(c);
    word_ = false;
    remark_ = remark_on(InputRemark::Kind::kAwaitsSilence, line());
    remark_.act = awaits_;
  }
  return std::nullopt;
}

// A letter may be of several bytes.
void TypedKeys::take_back() noexcept {
  while (size_ > 0) {
    if ((static_cast<unsigned char>(line_[--size_]) & 0xC0) != 0x80) return;
  }
}

std::optional<OperatorAct> TypedKeys::quiet(Nanoseconds now) noexcept {
  if (!quiet_since_) quiet_since_ = now;
  quiet_ = now;
  const Nanoseconds silence = quiet_ - *quiet_since_;
  if (awaits_ != OperatorAct::kNone) {
    if (silence < (word_ ? kBefore : kAfterLetter)) return std::nullopt;
    clear();
    return std::exchange(awaits_, OperatorAct::kNone);
  }
  if (size_ == 0 || silence < kBefore) return std::nullopt;
  // A line of which every key has been done is over.
  const std::string_view said = line();
  if (std::all_of(said.begin(), said.end(), [](char c) { return is_stop_key(c) || is_hold_key(c); })) clear();
  if (size_ > 0 && silence >= kAfterLetter && !std::exchange(told_, true)) {
    remark_ = remark_on(InputRemark::Kind::kUnfinished, said);
  }
  return std::nullopt;
}

void TypedKeys::forget() noexcept {
  clear();
  escape_ = Escape::kNone;
  awaits_ = OperatorAct::kNone;
  quiet_since_.reset();
}

InputRemark TypedKeys::take_remark() noexcept { return std::exchange(remark_, {}); }

}  // namespace farhand
