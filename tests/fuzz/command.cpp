// Addresses on the command line, what an operator's pipe says in whichever pieces it comes, and what the same bytes
// mean as keys. The first line is an address, the rest the pipe's, in pieces that end at 0xFF. Among keys a byte 0xFF
// and the next one are a silence, of ten milliseconds for each of its units.
#include <unistd.h>

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "common/link/udp.hpp"
#include "common/runtime/operator_input.hpp"
#include "common/runtime/operator_words.hpp"
#include "tests/fuzz/targets.hpp"

namespace farhand::fuzz {
namespace {

bool check_address(const std::string& text, EndpointUse use) {
  try {
    const UdpEndpoint endpoint = parse_endpoint(text, use);
    require(parse_endpoint(to_string(endpoint), use) == endpoint, "an address is read back from its text");
    require(use == EndpointUse::kListen || endpoint.port > 0, "a peer has a port");
    return true;
  } catch (const std::invalid_argument& error) {
    require(std::string(error.what()).starts_with("address '"), "a wrong address is named");
  }
  return false;
}

std::string small(std::string text) {
  for (char& c : text) c = static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
  return text;
}

OperatorAct intended(const std::string& word) {
  if (word == "engage") return OperatorAct::kEngage;
  if (word == "reset") return OperatorAct::kReset;
  if (word == "home") return OperatorAct::kHome;
  if (word == "identify") return OperatorAct::kIdentify;
  if (word == "friction") return OperatorAct::kSweep;
  return OperatorAct::kNone;
}

// A line is an act if it is one of five words with blanks around it, and a stop if it is not.
std::vector<OperatorAct> plain_acts(const std::string& said) {
  std::vector<OperatorAct> acts;
  for (std::size_t begin = 0; begin < said.size();) {
    const std::size_t end = std::min(said.find('\n', begin), said.size());
    std::string line = said.substr(begin, end - begin);
    constexpr const char* kBlank = " \t\r";
    line.erase(0, std::min(line.find_first_not_of(kBlank), line.size()));
    line.erase(line.find_last_not_of(kBlank) + 1);
    OperatorAct act = intended(line);
    if (act == OperatorAct::kNone) act = small(line) == "hold" ? OperatorAct::kHold : OperatorAct::kStop;
    if (!line.empty() || end < said.size()) acts.push_back(act);
    begin = end + 1;
  }
  return acts;
}

// A stop overtakes what still waits: what was said is given in its order, but for runs that end before a stop.
bool in_order(const std::vector<OperatorAct>& given, const std::vector<OperatorAct>& said) {
  const std::size_t m = given.size();
  // Of the rest of what was said and the rest of what was given, by the first of the latter: are they so? And from some
  // later stop on?
  std::vector<bool> rest(m + 1), from_a_stop(m + 1);
  rest[m] = true;
  for (auto one = said.rbegin(); one != said.rend(); ++one) {
    std::vector<bool> with_it(m + 1);
    for (std::size_t j = 0; j < m; ++j) with_it[j] = given[j] == *one && rest[j + 1];
    for (std::size_t j = 0; j <= m; ++j) {
      rest[j] = with_it[j] || from_a_stop[j];
      if (*one == OperatorAct::kStop) from_a_stop[j] = from_a_stop[j] || with_it[j];
    }
  }
  return rest[0];
}

// More than may wait is dropped, and counted.
bool in_order_with_gaps(const std::vector<OperatorAct>& given, const std::vector<OperatorAct>& said) {
  auto next = given.begin();
  for (const OperatorAct one : said) next += next != given.end() && *next == one;
  return next == given.end();
}

// What of the line lies before the cursor, as an editor without any meaning sees it.
std::string edited(const std::string& typed) {
  std::string line;
  for (const char c : typed) {
    if (c == '\x7f' || c == '\b') {
      while (!line.empty() && (static_cast<unsigned char>(line.back()) & 0xC0) == 0x80) line.pop_back();
      if (!line.empty()) line.pop_back();
    } else if (c == '\n' || c == '\r' || c == '\x1b' || c == '\x15') {
      line.clear();
    } else if (static_cast<unsigned char>(c) >= 0x20) {
      line += c;
    }
  }
  return line;
}

// An act that lets something move must be the last thing that was meant: a letter that stood alone, or a line that ends
// with a word.
void require_intent(OperatorAct act, const std::string& typed, bool silence_before_last, Nanoseconds silence) {
  const char last = typed.empty() ? '\0' : typed.back();
  if (last == '\n' || last == '\r') {
    const std::string line = edited(typed.substr(0, typed.size() - 1)), word = name_of(act);
    require(line.ends_with(word) && intended(word) == act, "a line with Enter says the word of its act");
    require(silence >= TypedKeys::kBefore, "nothing follows a word");
  } else {
    constexpr std::string_view kLetters = "eroif";
    const OperatorAct acts[] = {OperatorAct::kEngage, OperatorAct::kReset, OperatorAct::kHome, OperatorAct::kIdentify,
                                OperatorAct::kSweep};
    const std::size_t which = kLetters.find(last);
    require(which != std::string_view::npos && acts[which] == act, "a letter asks for its act");
    require(silence_before_last && silence >= TypedKeys::kAfterLetter, "a letter that acts stood alone");
  }
}

void check_keys(const std::string& said) {
  TypedKeys keys;
  std::string typed;
  Nanoseconds now = 0, silence = 0;
  bool silence_before_last = false, looked = false;
  for (std::size_t k = 0; k < said.size(); ++k) {
    if (said[k] == '\xFF') {
      const int units = ++k < said.size() ? static_cast<unsigned char>(said[k]) : 0;
      for (int i = 0; i < units; ++i) {
        const auto act = keys.quiet(now += 10 * kMillisecond);
        if (std::exchange(looked, true)) silence += 10 * kMillisecond;
        require(act != OperatorAct::kStop, "silence stops nothing");
        if (act) require_intent(*act, typed, silence_before_last, silence);
      }
      continue;
    }
    const char c = said[k];
    const std::string line = edited(typed);
    const bool whole_word = (c == '\n' || c == '\r') &&
                            (intended(line) != OperatorAct::kNone || small(line) == "hold" ||
                             line.ends_with("engage") || line.ends_with("reset") || line.ends_with("home") ||
                             line.ends_with("identify") || line.ends_with("friction") || small(line).ends_with("hold"));
    const bool edits = c == '\x7f' || c == '\b' || c == '\x15';
    const bool stops = (static_cast<unsigned char>(c) <= 0x20 && !edits) || is_stop_letter(c);
    const auto act = keys.take(c);
    require(!stops || whole_word || act == OperatorAct::kStop, "a key that could be meant as stop stops");
    require(!act || !needs_intent(*act), "no key lets anything move at once");
    silence_before_last = silence >= TypedKeys::kBefore;
    silence = 0;
    looked = false;
    typed += c;
  }
}

}  // namespace

bool command(Bytes input) {
  const auto line_end = std::find(input.begin(), input.end(), '\n');
  const std::string address(input.begin(), line_end);
  const bool listens = check_address(address, EndpointUse::kListen), dials = check_address(address, EndpointUse::kPeer);
  require(!dials || listens, "where one may dial one may listen");

  const std::string said(line_end == input.end() ? line_end : line_end + 1, input.end());
  check_keys(said);
  int ends[2];
  if (said.size() > 4096 || ::pipe(ends) != 0) return listens;
  std::vector<OperatorAct> acts;
  std::string whole;
  {
    OperatorInput operator_input(ends[0]);
    std::size_t polls = 0;
    for (std::size_t begin = 0; begin < said.size();) {
      const std::size_t end = std::min(said.find('\xFF', begin), said.size());
      const std::string piece = said.substr(begin, end - begin);
      whole += piece;
      require(::write(ends[1], piece.data(), piece.size()) == static_cast<ssize_t>(piece.size()), "a pipe has room");
      // A tick looks once.
      if (const auto act = operator_input.poll(0)) acts.push_back(*act);
      ++polls;
      begin = end + 1;
    }
    ::close(ends[1]);
    for (std::size_t poll = 0; poll < whole.size() + polls + 3; ++poll) {
      if (const auto act = operator_input.poll(0)) acts.push_back(*act);
    }
    require(operator_input.closed(), "an input that has ended is known to");
  }
  ::close(ends[0]);
  const std::vector<OperatorAct> said_acts = plain_acts(whole);
  const bool none_dropped = said_acts.size() <= OperatorInput::kWaiting;
  require(none_dropped ? in_order(acts, said_acts) : in_order_with_gaps(acts, said_acts),
          "the acts are those that the lines say, in their order");
  return listens || !acts.empty();
}

}  // namespace farhand::fuzz
