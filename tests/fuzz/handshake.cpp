// What comes before the first packet: greetings, datagrams of strangers at the listener's door, and someone on the path
// between two stations who drops, repeats, damages, cuts and makes up datagrams. Nobody without the key gets a session,
// changes what is agreed on, or keeps the two apart once he is gone.
#include <google/protobuf/stubs/logging.h>

#include <algorithm>
#include <string>
#include <vector>

#include "tests/fuzz/own_random.hpp"
#include "tests/fuzz/targets.hpp"
#include "tests/support/handshake_network.hpp"

namespace farhand::fuzz {
namespace {

using Kind = HandshakeEvent::Kind;
using Party = HandshakeNetwork::Party;

const PairingKey& key() {
  static const PairingKey key = PairingKey::from_text(std::string(64, '5'));
  return key;
}
const PairingKey& other_key() {
  static const PairingKey key = PairingKey::from_text(std::string(64, '6'));
  return key;
}

Greeting greeting_of(Role role) { return {.role = role, .configuration = "0123456789abcdef", .program = "1.2.3"}; }
std::unique_ptr<Handshaker> box(const PairingKey& with) {
  return std::make_unique<OwnRandom>(
      1, [&] { return Handshaker::dialer(with, greeting_of(Role::kFollower), kListenerAt); });
}
std::unique_ptr<Handshaker> station() {
  return std::make_unique<OwnRandom>(2, [] { return Handshaker::listener(key(), greeting_of(Role::kLeader)); });
}

// As in the secured link: a session on which nothing comes is given back after five seconds, and the box calls again.
void require_they_meet(HandshakeNetwork& network, Party& box, Party& station, Nanoseconds at_most) {
  Nanoseconds silent_since = network.now();
  std::size_t sessions = box.sessions.size();
  const bool met = network.run_until(
      [&] {
        if (box.sessions.size() != sessions) silent_since = network.now();
        sessions = box.sessions.size();
        if (box.sessions.empty()) return false;
        if (!station.sessions.empty() && share_keys(*box.sessions.back(), *station.sessions.back())) return true;
        if (network.now() - silent_since >= 5 * kSecond) {
          box.handshaker->give_back(std::move(box.sessions.back()), network.now());
          box.sessions.pop_back();
          sessions = box.sessions.size();
        }
        return false;
      },
      at_most);
  require(met, "the two meet once nobody is between them");
  require(box.count(Kind::kRefused) + station.count(Kind::kRefused) == 0, "nobody else makes them refuse each other");
}

std::vector<std::byte> to_bytes(Bytes bytes) {
  std::vector<std::byte> out(bytes.size());
  std::transform(bytes.begin(), bytes.end(), out.begin(), [](std::uint8_t b) { return static_cast<std::byte>(b); });
  return out;
}

bool greetings(Bytes input) {
  const google::protobuf::LogSilencer silent;  // it says on stderr what is no text
  const std::optional<Greeting> read = decode_greeting(to_bytes(input));
  if (!read) return false;
  const Greeting own = greeting_of(Role::kLeader);
  const auto difference = disagreement(own, *read);
  const bool fits = read->version == own.version && read->role == Role::kFollower && read->joints == own.joints &&
                    read->units == own.units && read->configuration == own.configuration;
  require(fits == !difference, "who differs is refused, and nobody else");
  if (difference) {
    require(difference->size() < 300 &&
                std::all_of(difference->begin(), difference->end(), [](char c) { return c >= ' ' && c <= '~'; }),
            "a refusal can be shown to a person");
  }
  const std::string again = encode_greeting(*read);
  const auto twice = decode_greeting(std::as_bytes(std::span(again)));
  require(twice && encode_greeting(*twice) == again, "a greeting comes back as it was sent");
  return true;
}

// Each: who (a few addresses, the box's among them), when, two bytes of length, what.
bool strangers(Cursor cursor) {
  HandshakeNetwork network({}, 1);
  Party& listener = network.add(station(), kListenerAt);
  std::size_t asked = 0, answered = 0;
  network.on_path = [&](const UdpEndpoint&, HandshakeDatagram& datagram) {
    answered += datagram.size;
    return false;
  };
  for (int said = 0; !cursor.empty() && said < 200; ++said) {
    const std::uint8_t who = cursor.byte(), length_low = cursor.byte(), length_high = cursor.byte();
    const auto datagram = to_bytes(cursor.take(length_low | (length_high & 1) << 8));
    network.inject(who % 4 == 0 ? kDialerAt : endpoint(who % 4), kListenerAt, datagram);
    asked += datagram.size();
    network.run((who >> 4) * 20 * kMillisecond + kMillisecond);
  }
  // A cookie costs no more than was asked; who holds one gets at most the flight of the listener, repeated as often as
  // he asks, and is no stranger to his own address.
  require(answered <= 8 * asked, "an answer costs an address in the way of it little");
  require(listener.count(Kind::kRefused) == 0, "a stranger is not told what does not fit");
  const bool taken = answered > 0;
  network.on_path = nullptr;
  Party& caller = network.add(box(key()), endpoint(77));
  require_they_meet(network, caller, listener, 40 * kSecond);
  return taken;
}

// What happens to each datagram in turn; when there is no more, nothing.
bool on_the_path(Cursor cursor, bool wrong_key) {
  HandshakeNetwork network({.delay_s = 0.01}, 1);
  Party& dialer = network.add(box(wrong_key ? other_key() : key()), kDialerAt);
  Party& listener = network.add(station(), kListenerAt);
  std::vector<std::byte> kept;
  network.on_path = [&](const UdpEndpoint& from, HandshakeDatagram& datagram) {
    if (cursor.empty()) return true;
    const UdpEndpoint to = from == kListenerAt ? kDialerAt : kListenerAt;
    const std::uint8_t what = cursor.byte();
    switch (what & 7) {
      case 0:
        return false;
      case 1: {  // damaged
        const std::size_t at = cursor.byte() | (what >> 7) << 8;
        datagram.bytes[at % datagram.size] ^= static_cast<std::byte>(cursor.byte());
        return true;
      }
      case 2:  // cut
        datagram.size = static_cast<std::uint16_t>((cursor.byte() | (what >> 7) << 8) % (datagram.size + 1));
        return true;
      case 3:  // late, after those that follow
        network.inject(from, to, datagram.view(), (1 + (what >> 3)) * 40 * kMillisecond);
        return false;
      case 4:  // made up, before
        network.inject(from, to, to_bytes(cursor.take(cursor.byte())));
        return true;
      case 5:  // twice
        network.inject(from, to, datagram.view(), (what >> 3) * 40 * kMillisecond);
        return true;
      case 6:  // back to where it came from, or what was kept, to either
        if (kept.empty()) kept.assign(datagram.view().begin(), datagram.view().end());
        network.inject((what & 8) != 0 ? from : to, (what & 8) != 0 ? to : from,
                       (what & 16) != 0 ? kept : to_bytes({}));
        network.inject(to, from, datagram.view());
        return true;
      default:
        return true;
    }
  };
  if (wrong_key) {
    network.run(3 * kSecond);  // five calls
    require(dialer.sessions.empty() && listener.sessions.empty(), "the wrong key gets no session");
    require(dialer.count(Kind::kAgreed) + listener.count(Kind::kAgreed) == 0, "the wrong key agrees with nobody");
    return false;
  }
  network.run_until([&] { return cursor.empty() || (!dialer.sessions.empty() && !listener.sessions.empty()); },
                    30 * kSecond);
  network.on_path = nullptr;
  require_they_meet(network, dialer, listener, 60 * kSecond);
  return true;
}

}  // namespace

bool handshake(Bytes input) {
  Cursor cursor(input);
  switch (cursor.byte() & 3) {
    case 0:
      return greetings(input.empty() ? input : input.subspan(1));
    case 1:
      return strangers(cursor);
    case 2:
      return on_the_path(cursor, false);
    default:
      return on_the_path(cursor, true);
  }
}

}  // namespace farhand::fuzz
