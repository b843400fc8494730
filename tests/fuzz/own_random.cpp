#define OPENSSL_SUPPRESS_DEPRECATED  // there is no other way to give OpenSSL random numbers that are none
#include "tests/fuzz/own_random.hpp"

#include <openssl/rand.h>

namespace farhand::fuzz {
namespace {

std::uint64_t state = 0;

std::uint64_t next() {  // splitmix64
  std::uint64_t z = state += 0x9E3779B97F4A7C15;
  z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9;
  z = (z ^ z >> 27) * 0x94D049BB133111EB;
  return z ^ z >> 31;
}

int fill(unsigned char* to, int size) {
  for (int i = 0; i < size; ++i) to[i] = static_cast<unsigned char>(next());
  return 1;
}

int always() { return 1; }

}  // namespace

void draw_from(std::uint64_t seed) {
  static const RAND_METHOD method{nullptr, fill, nullptr, nullptr, fill, always};
  [[maybe_unused]] static const int set = RAND_set_rand_method(&method);
  state = seed;
}

OwnRandom::Turn::Turn(OwnRandom& of) : party(of) { draw_from(party.state_); }

OwnRandom::Turn::~Turn() {
  party.state_ = state;
  if (!party.inner_) return;
  HandshakeDatagram datagram;
  while (party.inner_->take_outgoing(datagram)) party.outgoing_.push_back(datagram);
  while (auto session = party.inner_->take_session()) party.sessions_.push_back(std::move(session));
  while (auto event = party.inner_->take_event()) party.events_.push_back(*event);
}

}  // namespace farhand::fuzz
