// Packet <-> datagram: Protobuf of constant size with a CRC-32C at the end.
//
// A bare Protobuf message accepts most bit flips. Here size, every tag and every length byte are compared with the only
// layout there is, then the checksum, and only then is the message parsed: nothing unexpected reaches the parser, and a
// reused message allocates nothing.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "common/link/packet.hpp"

namespace farhand {

namespace wire {
class Packet;
}

enum class DecodeResult : std::uint8_t {
  kOk,
  kSize,       // not the size of a packet for this number of joints
  kFormat,     // a tag or a length differs
  kChecksum,   // damaged on the way
  kVersion,    // intact, but the peer speaks another version
  kValue,      // unknown state or limit bit
  kNotFinite,  // NaN or Inf in position, velocity or torque
};
inline constexpr std::size_t kDecodeResults = 7;

// CRC-32C (Castagnoli): the check value of "123456789" is 0xE3069283.
std::uint32_t crc32c(std::span<const std::byte> bytes) noexcept;

// For N = 1 and 2. One codec serves one sender and one receiver within one thread.
template <int N>
class PacketCodec {
 public:
  static constexpr std::size_t kSize = 75 + 3 * 8 * std::size_t{N};

  PacketCodec();
  ~PacketCodec();
  PacketCodec(const PacketCodec&) = delete;
  PacketCodec& operator=(const PacketCodec&) = delete;

  // Valid until the next call. Non-finite motion is encoded as it is; the receiver rejects it.
  std::span<const std::byte> encode(const Packet<N>& packet) noexcept;
  // `out` is written only with kOk.
  DecodeResult decode(std::span<const std::byte> bytes, Packet<N>& out) noexcept;

 private:
  std::unique_ptr<wire::Packet> message_;
  std::array<std::byte, kSize> buffer_{};
  std::array<std::byte, kSize> skeleton_{};   // tags and lengths, zero elsewhere
  std::array<std::byte, kSize> structure_{};  // 0xFF where a byte is tag or length
};

extern template class PacketCodec<1>;
extern template class PacketCodec<2>;

}  // namespace farhand
