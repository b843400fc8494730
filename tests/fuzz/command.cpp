// Addresses on the command line, and what an operator's pipe says in whichever pieces it comes. The first line is an
// address, the rest the pipe's, in pieces that end at 0xFF.
#include <unistd.h>

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/link/udp.hpp"
#include "common/runtime/operator_input.hpp"
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

// A line is an act if it is one of five words with blanks around it.
std::vector<OperatorAct> plain_acts(const std::string& said) {
  std::vector<OperatorAct> acts;
  for (std::size_t begin = 0; begin < said.size();) {
    const std::size_t end = std::min(said.find('\n', begin), said.size());
    std::string line = said.substr(begin, end - begin);
    constexpr const char* kBlank = " \t\r";
    line.erase(0, std::min(line.find_first_not_of(kBlank), line.size()));
    line.erase(line.find_last_not_of(kBlank) + 1);
    if (line == "engage") acts.push_back(OperatorAct::kEngage);
    if (line == "hold") acts.push_back(OperatorAct::kHold);
    if (line == "stop") acts.push_back(OperatorAct::kStop);
    if (line == "reset") acts.push_back(OperatorAct::kReset);
    if (line == "home") acts.push_back(OperatorAct::kHome);
    if (line == "identify") acts.push_back(OperatorAct::kIdentify);
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

}  // namespace

bool command(Bytes input) {
  const auto line_end = std::find(input.begin(), input.end(), '\n');
  const std::string address(input.begin(), line_end);
  const bool listens = check_address(address, EndpointUse::kListen), dials = check_address(address, EndpointUse::kPeer);
  require(!dials || listens, "where one may dial one may listen");

  const std::string said(line_end == input.end() ? line_end : line_end + 1, input.end());
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
      if (const auto act = operator_input.poll()) acts.push_back(*act);
      ++polls;
      begin = end + 1;
    }
    ::close(ends[1]);
    for (std::size_t poll = 0; poll < whole.size() + polls + 3; ++poll) {
      if (const auto act = operator_input.poll()) acts.push_back(*act);
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
