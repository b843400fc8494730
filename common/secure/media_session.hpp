// Packets sealed as SRTP: one session with one peer, with the keys of a handshake. A sealed packet consists of an RTP
// header (12 bytes), the encrypted packet, and a tag (16 bytes) over both. No function allocates or locks after
// construction.
//
// The replay window holds 4096 packets, because at 1 kHz and 500 ms +-50 % authentic packets come up to 500 late. The
// upper bits of a packet's index are guessed from the last packets; after 2^15 lost packets the guess may be wrong for
// ever. Therefore a session that has been silent for 5 s is never used again (SecureChannel).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "common/link/udp.hpp"

namespace farhand {

// The two ends of a link: the patient's box dials out.
enum class LinkEnd : std::uint8_t { kDialer, kListener };

// Keys and salts of both directions in the order in which the exporter of RFC 5764 gives them.
struct SrtpKeys {
  static constexpr std::size_t kKeyBytes = 16, kSaltBytes = 12;
  std::array<std::uint8_t, 2 * (kKeyBytes + kSaltBytes)> bytes{};
  ~SrtpKeys();
};

class MediaSession {
 public:
  static constexpr std::size_t kOverhead = 12 + 16;
  static constexpr std::size_t kLargestDatagram = 512;
  static constexpr std::uint32_t kReplayWindow = 4096;

  // Throws std::runtime_error when libsrtp refuses.
  MediaSession(LinkEnd own_end, const SrtpKeys& keys, const UdpEndpoint& peer);
  ~MediaSession();
  MediaSession(const MediaSession&) = delete;
  MediaSession& operator=(const MediaSession&) = delete;

  const UdpEndpoint& peer() const noexcept { return peer_; }

  // Valid until the next call; empty if it does not fit.
  std::span<const std::byte> seal(std::span<const std::byte> packet) noexcept;

  enum class Opening : std::uint8_t { kOpened, kMalformed, kForged, kReplayed };
  // In place. `packet` is set only with kOpened.
  Opening open(std::span<std::byte> datagram, std::span<std::byte>& packet) noexcept;

 private:
  struct Contexts;
  std::unique_ptr<Contexts> contexts_;
  UdpEndpoint peer_;
  std::uint32_t own_source_;
  std::uint32_t sent_;
  alignas(8) std::array<std::byte, kLargestDatagram + 64> buffer_{};
};

}  // namespace farhand
