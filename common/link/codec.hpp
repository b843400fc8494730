// Packet <-> datagram: Protobuf of constant size with a CRC-32C at the end.
//
// A bare Protobuf message accepts most bit flips. This codec first compares size, every tag and every length byte with
// the only possible layout, then the checksum. After that every value is at a known place and is read there. The
// constructor checks these places against the bytes that Protobuf writes, so that other programs can read and write
// packets by proto/packet.proto.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "common/link/packet.hpp"

namespace farhand {

enum class DecodeResult : std::uint8_t {
  kOk,
  kSize,       // not the size of a packet for this number of joints, with or without its optional parts
  kFormat,     // a tag or a length differs
  kChecksum,   // damaged on the way
  kVersion,    // intact, but the peer speaks another version
  kValue,      // unknown state or limit bit, a flag that is neither 0 nor 1
  kNotFinite,  // NaN or Inf in position, velocity or torque, present or previous, in energy or friction
};
inline constexpr std::size_t kDecodeResults = 7;

// CRC-32C (Castagnoli): the check value of "123456789" is 0xE3069283.
std::uint32_t crc32c(std::span<const std::byte> bytes) noexcept;

// Parts of a packet that only some architectures send.
struct PacketParts {
  bool energy = false, previous = false;
};

// For N = 1 and 2. One codec serves one sender and one receiver within one thread.
template <int N>
class PacketCodec {
 public:
  static constexpr std::size_t kSize = 91 + 3 * 8 * std::size_t{N};
  static constexpr std::size_t kEnergyBytes = 1 + 8;  // in addition to kSize, in packets with energy
  static constexpr std::size_t kPreviousBytes = 3 * (3 + 8 * std::size_t{N}) + 2 + 4;  // and with the previous sample

  static constexpr std::size_t kMostBytes = kSize + kEnergyBytes + kPreviousBytes;

  // Throws std::logic_error if Protobuf writes packets in another layout.
  explicit PacketCodec(PacketParts parts = {});
  PacketCodec(const PacketCodec&) = delete;
  PacketCodec& operator=(const PacketCodec&) = delete;

  // Valid until the next call. Non-finite motion is encoded as it is; the receiver rejects it.
  std::span<const std::byte> encode(const Packet<N>& packet) noexcept;
  // `out` is written only with kOk.
  DecodeResult decode(std::span<const std::byte> bytes, Packet<N>& out) noexcept;

 private:
  using Bytes = std::array<std::byte, (kMostBytes + 7) / 8 * 8>;  // whole words
  PacketParts parts_;
  std::size_t size_;
  Bytes buffer_{};
  Bytes skeleton_{};   // tags and lengths, zero elsewhere
  Bytes structure_{};  // 0xFF where a byte is tag or length
};

}  // namespace farhand
