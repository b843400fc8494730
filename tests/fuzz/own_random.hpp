// Random numbers of a handshake from a seed, one stream for each party: a fuzzer repeats what it found, and what one
// party said in a recorded handshake is understood by the other when it is said again.
#pragma once

#include <cstdint>
#include <memory>

#include "common/secure/handshaker.hpp"

namespace farhand::fuzz {

// From now on OpenSSL draws from this stream, from its beginning; for the whole process.
void draw_from(std::uint64_t seed);

class OwnRandom final : public Handshaker {
 public:
  template <class Make>
  OwnRandom(std::uint64_t seed, Make&& make) : state_(seed) {
    const Turn turn(*this);
    inner_ = make();
  }

  void receive(const HandshakeDatagram& datagram, Nanoseconds now) override {
    const Turn turn(*this);
    inner_->receive(datagram, now);
  }
  void advance(Nanoseconds now) override {
    const Turn turn(*this);
    inner_->advance(now);
  }
  void give_back(std::unique_ptr<MediaSession> session, Nanoseconds now) override {
    inner_->give_back(std::move(session), now);
  }

 private:
  struct Turn {
    explicit Turn(OwnRandom& party);
    ~Turn();
    OwnRandom& party;
  };

  std::uint64_t state_;
  std::unique_ptr<Handshaker> inner_;
};

}  // namespace farhand::fuzz
