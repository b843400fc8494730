#include "common/secure/media_session.hpp"

#include <openssl/crypto.h>
#include <srtp2/srtp.h>

#include <algorithm>
#include <stdexcept>
#include <string>

#include "common/secure/srtp_cipher.hpp"

namespace farhand {
namespace {

constexpr std::size_t kHeaderBytes = 12;
constexpr auto kVersion2 = std::byte{0x80}, kPayloadType = std::byte{96};

// Every direction of every session has a key of its own, so the source may be the same in all. libsrtp then knows its
// streams before the first packet and makes none in the loop.
constexpr std::uint32_t kDialerSource = 0x66680001, kListenerSource = 0x66680002;

void store_big_endian(std::uint32_t value, std::span<std::byte> to) noexcept {
  for (std::size_t i = 0; i < to.size(); ++i) to[i] = static_cast<std::byte>(value >> 8 * (to.size() - 1 - i));
}

srtp_t make_context(const SrtpKeys& keys, LinkEnd sender) {
  const std::size_t side = sender == LinkEnd::kDialer ? 0 : 1;
  std::array<unsigned char, SrtpKeys::kKeyBytes + SrtpKeys::kSaltBytes> key_and_salt{};
  std::copy_n(keys.bytes.begin() + static_cast<std::ptrdiff_t>(side * SrtpKeys::kKeyBytes), SrtpKeys::kKeyBytes,
              key_and_salt.begin());
  std::copy_n(keys.bytes.begin() + static_cast<std::ptrdiff_t>(2 * SrtpKeys::kKeyBytes + side * SrtpKeys::kSaltBytes),
              SrtpKeys::kSaltBytes, key_and_salt.begin() + SrtpKeys::kKeyBytes);
  srtp_policy_t policy{};
  srtp_crypto_policy_set_aes_gcm_128_16_auth(&policy.rtp);
  srtp_crypto_policy_set_aes_gcm_128_16_auth(&policy.rtcp);
  policy.ssrc = {ssrc_specific, sender == LinkEnd::kDialer ? kDialerSource : kListenerSource};
  policy.key = key_and_salt.data();
  policy.window_size = MediaSession::kReplayWindow;
  srtp_t context = nullptr;
  const srtp_err_status_t status = srtp_create(&context, &policy);
  OPENSSL_cleanse(key_and_salt.data(), key_and_salt.size());
  if (status != srtp_err_status_ok) {
    throw std::runtime_error("libsrtp makes no session (status " + std::to_string(status) + ")");
  }
  return context;
}

}  // namespace

SrtpKeys::~SrtpKeys() { OPENSSL_cleanse(bytes.data(), bytes.size()); }

struct MediaSession::Contexts {
  srtp_t sending = nullptr, receiving = nullptr;
  ~Contexts() {
    if (sending != nullptr) srtp_dealloc(sending);
    if (receiving != nullptr) srtp_dealloc(receiving);
  }
};

MediaSession::MediaSession(LinkEnd own_end, const SrtpKeys& keys, const UdpEndpoint& peer)
    : contexts_(std::make_unique<Contexts>()),
      peer_(peer),
      own_source_(own_end == LinkEnd::kDialer ? kDialerSource : kListenerSource),
      sent_(0) {
  start_srtp();
  contexts_->sending = make_context(keys, own_end);
  contexts_->receiving = make_context(keys, own_end == LinkEnd::kDialer ? LinkEnd::kListener : LinkEnd::kDialer);
}

MediaSession::~MediaSession() = default;

std::span<const std::byte> MediaSession::seal(std::span<const std::byte> packet) noexcept {
  if (packet.size() + kOverhead > kLargestDatagram) return {};
  const std::span out(buffer_);
  out[0] = kVersion2;
  out[1] = kPayloadType;
  store_big_endian(sent_, out.subspan(2, 2));
  store_big_endian(sent_, out.subspan(4, 4));
  store_big_endian(own_source_, out.subspan(8, 4));
  ++sent_;
  std::copy(packet.begin(), packet.end(), out.begin() + kHeaderBytes);
  int size = static_cast<int>(kHeaderBytes + packet.size());
  if (srtp_protect(contexts_->sending, out.data(), &size) != srtp_err_status_ok) return {};
  return out.first(static_cast<std::size_t>(size));
}

MediaSession::Opening MediaSession::open(std::span<std::byte> datagram, std::span<std::byte>& packet) noexcept {
  // The one header there is, so that no option of RTP is ever parsed.
  if (datagram.size() < kOverhead || datagram.size() > kLargestDatagram || datagram[0] != kVersion2 ||
      datagram[1] != kPayloadType) {
    return Opening::kMalformed;
  }
  int size = static_cast<int>(datagram.size());
  switch (srtp_unprotect(contexts_->receiving, datagram.data(), &size)) {
    case srtp_err_status_ok:
      packet = datagram.subspan(kHeaderBytes, static_cast<std::size_t>(size) - kHeaderBytes);
      return Opening::kOpened;
    case srtp_err_status_replay_fail:
    case srtp_err_status_replay_old:
      return Opening::kReplayed;
    default:
      return Opening::kForged;
  }
}

}  // namespace farhand
