// What the seal costs per packet: encode, seal, open and decode beside a plain packet, and beside libsrtp called bare
// on the same bytes. (libsrtp with the cipher that Debian builds it with cannot stand here: it is replaced for the
// whole process.)
#include <benchmark/benchmark.h>
#include <srtp2/srtp.h>

#include <algorithm>
#include <chrono>

#include "common/link/codec.hpp"
#include "common/secure/srtp_cipher.hpp"
#include "netem/lab/sealed_pair.hpp"

namespace farhand {
namespace {

constexpr std::size_t kHeader = 12, kSize = kHeader + PacketCodec<1>::kSize;

// Both ends of libsrtp, and nothing of ours around it.
class Bare {
 public:
  Bare() {
    start_srtp();
    srtp_policy_t policy{};
    srtp_crypto_policy_set_aes_gcm_128_16_auth(&policy.rtp);
    srtp_crypto_policy_set_aes_gcm_128_16_auth(&policy.rtcp);
    policy.ssrc = {ssrc_specific, 1};
    policy.key = key_.data();
    policy.window_size = MediaSession::kReplayWindow;
    if (srtp_create(&sender_, &policy) != 0 || srtp_create(&receiver_, &policy) != 0) std::abort();
  }
  ~Bare() {
    srtp_dealloc(sender_);
    srtp_dealloc(receiver_);
  }
  Bare(const Bare&) = delete;
  Bare& operator=(const Bare&) = delete;

  bool there_and_back() noexcept {
    buffer_[0] = 0x80;
    buffer_[2] = static_cast<unsigned char>(++number_ >> 8);
    buffer_[3] = static_cast<unsigned char>(number_ & 0xFF);
    buffer_[11] = 1;
    int size = static_cast<int>(kSize);
    return srtp_protect(sender_, buffer_.data(), &size) == 0 && srtp_unprotect(receiver_, buffer_.data(), &size) == 0;
  }

 private:
  std::array<unsigned char, 28> key_{1, 2, 3};
  srtp_t sender_ = nullptr, receiver_ = nullptr;
  std::uint16_t number_ = 0;
  alignas(8) std::array<unsigned char, 512> buffer_{};
};

struct Coded {
  PacketCodec<1> codec;
  Packet<1> packet, out;

  bool plain() noexcept {
    ++packet.seq;
    return codec.decode(codec.encode(packet), out) == DecodeResult::kOk;
  }

  bool secured(SealedPair& pair) noexcept {
    ++packet.seq;
    const auto sealed = pair.dialer->seal(codec.encode(packet));
    std::copy(sealed.begin(), sealed.end(), buffer.begin());  // the network
    std::span<std::byte> opened;
    return pair.listener->open(std::span(buffer).first(sealed.size()), opened) == MediaSession::Opening::kOpened &&
           codec.decode(opened, out) == DecodeResult::kOk;
  }

  alignas(8) std::array<std::byte, MediaSession::kLargestDatagram> buffer;
};

void PlainPacket(benchmark::State& state) {
  Coded coded;
  for (auto _ : state) {
    if (!coded.plain()) state.SkipWithError("rejected");
  }
}
BENCHMARK(PlainPacket);

void BareLibsrtp(benchmark::State& state) {
  Bare bare;
  for (auto _ : state) {
    if (!bare.there_and_back()) state.SkipWithError("rejected");
  }
}
BENCHMARK(BareLibsrtp);

void SecuredPacket(benchmark::State& state) {
  Coded coded;
  SealedPair pair(1);
  for (auto _ : state) {
    if (!coded.secured(pair)) state.SkipWithError("rejected");
  }
}
BENCHMARK(SecuredPacket);

// The quickest of many short turns of each, so that a busy machine disturbs both alike and little.
void SecuredOverBarePlusPlain(benchmark::State& state) {
  using Clock = std::chrono::steady_clock;
  Coded coded;
  Bare bare;
  SealedPair pair(2);
  double parts = 1e9, whole = 1e9;
  bool good = true;
  const auto turn = [&](double& quickest, auto&& once) {
    const auto begin = Clock::now();
    for (int i = 0; i < 100; ++i) good = once() && good;
    quickest = std::min(quickest, std::chrono::duration<double, std::nano>(Clock::now() - begin).count() / 100);
  };
  for (auto _ : state) {
    turn(parts, [&] { return bare.there_and_back() && coded.plain(); });
    turn(whole, [&] { return coded.secured(pair); });
  }
  if (!good) state.SkipWithError("rejected");
  state.counters["secured_ns"] = whole;
  state.counters["bare_plus_plain_ns"] = parts;
  state.counters["ratio"] = whole / parts;
}
BENCHMARK(SecuredOverBarePlusPlain);

}  // namespace
}  // namespace farhand
